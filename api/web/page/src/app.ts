// Puts the page together: session, streams, lane, control. One of each per page.
import { computed, effect, signal } from '@preact/signals';
import { create, toBinary } from '@bufbuild/protobuf';
import { AxisService } from '@proto/axis_service_pb';
import { RenewLeaseRequestSchema } from '@proto/lease_service_pb';
import { Role } from '@proto/access_pb';
import { Reason, type ErrorDetail } from '@proto/error_pb';
import * as control from './hold/control';
import { Kind } from './lane/frame';
import { browserWorld, Lane } from './lane/lane';
import { Store, STREAM_MS } from './model/store';
import { detailOf, duration } from './model/wire';
import { machine } from './route';
import { clients, CALL_MS, problem, signedOut } from './transport/clients';
import { refreshSession, serves, session } from './transport/session';
import { keepOpen } from './transport/stream';
import { notify } from './ui/notices';

export const store = new Store();
export const visible = signal(document.visibilityState === 'visible');
/** The machine of this page is one of the gateway's. */
const signedIn = computed(() => serves(session.value, machine));
const wanted = computed(() => visible.value && signedIn.value);

/** Screens that need more than the latest states say so while they are shown. */
export const watchesBuses = signal(false);

const FIELDS = [
  'unit', 'state', 'link', 'link_error', 'fault', 'enabled', 'enabled_by_daemon', 'stop_held', 'inhibited', 'position', 'velocity',
  'target', 'moving', 'positive_direction', 'in_position', 'homed', 'trust', 'position_source', 'alarm_code', 'alarm_name',
  'inputs', 'outputs', 'measured_at', 'age', 'simulated', 'command_id', 'bus', 'node', 'model', 'motion_cause', 'drift',
  'link_note', 'lease_holder', 'following_error', 'holds',
];

const failed = (error: unknown) => { if (signedOut(error)) void refreshSession(); };

export const states = keepOpen(wanted, async (signal, live) => {
  const request = { period: duration(STREAM_MS), fields: { paths: FIELDS } };
  for await (const { axes, instanceId, dropped } of clients.axes.watchAxes(request, { signal })) {
    const restarted = store.instance.peek() !== '' && store.instance.peek() !== instanceId;
    live();
    store.take(axes, instanceId, dropped, performance.now());
    if (restarted) void refreshMachine();
  }
}, { silence: 2000, failed });

let cursor: { instanceId: string; afterSequence: bigint } = { instanceId: '', afterSequence: 0n };

/** Why the states were lost, as the daemon says it; undefined: they are not, or nothing is known. */
export const lostBy = computed(() => (states.state.value === 'lost' && states.why.value !== undefined ? problem(states.why.value) : undefined));
/** The daemon takes nothing from this page: what is lost is no connection. */
export const refused = computed(() => lostBy.value?.reason === Reason.ACCESS_DENIED);

export const happenings = keepOpen(wanted, async (signal, live) => {
  for await (const message of clients.events.watchEvents(cursor, { signal })) {
    live();
    const anew = message.instanceId !== cursor.instanceId;
    cursor = { instanceId: message.instanceId, afterSequence: message.cursor };
    store.heardEvents(message.events, anew);
    if (message.events.some(({ content }) => content.case === 'inhibitChange' || content.case === 'configurationReloaded')) {
      void refreshMachine();
    }
  }
}, { failed });

export const traffic = keepOpen(computed(() => wanted.value && watchesBuses.value), async (signal, live) => {
  for await (const { buses } of clients.buses.watchBusStatistics({ period: duration(1000) }, { signal })) {
    live();
    store.statistics.value = buses;
    store.buses.value = (await clients.buses.listBuses({}, { timeoutMs: CALL_MS, signal })).buses;
    store.budgets.value = (await clients.buses.getBudget({}, { timeoutMs: CALL_MS, signal })).budgets;
  }
}, { failed });

/** What changes seldom: who this is, the buses and what they promise. */
export async function refreshMachine(): Promise<void> {
  const quiet = (error: unknown) => { failed(error); return null; };
  const options = { timeoutMs: CALL_MS };
  const [info, statistics, budgets, commands] = await Promise.all([
    clients.system.getInfo({}, options).catch(quiet), clients.buses.getBusStatistics({}, options).catch(quiet),
    clients.buses.getBudget({}, options).catch(quiet), clients.commands.listCommands({ limit: 200 }, options).catch(quiet),
  ]);
  if (info !== null) store.info.value = info;
  if (statistics !== null) store.statistics.value = statistics.buses;
  if (budgets !== null) store.budgets.value = budgets.budgets;
  if (commands !== null) store.mergeCommands(commands.commands);
}

/** What the person may do with an axis. */
export function roleFor(axis: string): Role {
  const info = store.info.value;
  if (info === null) return Role.UNSPECIFIED;
  return info.axisRoles.find((role) => role.axis === axis)?.role ?? info.role;
}

// The lane.

const laneUrl = `${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/lane${machine === '' ? '' : `?machine=${machine}`}`;
export const lane = new Lane(browserWorld(laneUrl));
const laneTick = signal(0);
setInterval(() => { laneTick.value += 1; }, 250);
/** Milliseconds that the lane takes; infinite: it is closed. */
export const laneTakes = computed(() => {
  laneTick.value;
  lane.state.value;
  lane.roundTrip.value;
  return lane.takes();
});

// Control of axes.

const controlState = signal<control.State>(control.none);
export const leases = computed(() => controlState.value.leases);
/** Fencing token, 0 without one: then this page only looks on. */
export const tokenFor = (axis: string): bigint => control.tokenOf(controlState.value, axis);

function drive(event: control.Event): void {
  const { state, effects } = control.step(controlState.peek(), event);
  if (state !== controlState.peek()) controlState.value = state;
  for (const effect of effects) {
    if (effect.do === 'renew') renew(effect.token, effect.sent);
    if (effect.do === 'release') void clients.leases.releaseLease({ leaseToken: effect.token }, { timeoutMs: CALL_MS }).catch(() => {});
    if (effect.do === 'ended' && effect.why !== 'released') {
      notify('warning', { key: `control.ended.${effect.why}`, values: { axes: effect.axes.join(', ') } });
    }
  }
  if (controlState.peek().leases.length > 0) paint();
}

function renew(token: bigint, sent: number): void {
  const message = toBinary(RenewLeaseRequestSchema, create(RenewLeaseRequestSchema, { leaseToken: token }));
  lane.call('axisd.v1.LeaseService/RenewLease', message).then((answer) => {
    if (answer.kind === Kind.answer && answer.status === 0) drive({ type: 'renewed', token, sent });
    else if (detailOf(answer.details)?.reason === Reason.LEASE_LOST) drive({ type: 'lost', token });
  }).catch(() => {});
}

let painting = 0;
function paint(): void {
  if (painting !== 0) return;
  // The time of the frame itself may be that of before a hang.
  painting = requestAnimationFrame(() => { painting = 0; drive({ type: 'frame', at: performance.now() }); });
}

const LABEL = 'axisd-web';

/** Takes control. `take`: also from others. Null: it went well. */
export async function takeControl(axes: readonly string[], take: boolean): Promise<ErrorDetail | null> {
  try {
    const answer = await clients.leases.acquireLease(
      { axes: [...axes], ttl: duration(control.TTL_MS), label: LABEL, take, requestId: crypto.randomUUID() }, { timeoutMs: CALL_MS });
    if (!visible.peek()) {
      void clients.leases.releaseLease({ leaseToken: answer.leaseToken }).catch(() => {});
      return null;
    }
    drive({ type: 'acquired', token: answer.leaseToken, axes: answer.lease?.axes ?? [...axes], at: performance.now() });
    return null;
  } catch (error) {
    failed(error);
    return problem(error);
  }
}

export function endControl(why: control.Ending, axes?: readonly string[]): void {
  drive(axes === undefined ? { type: 'end', why } : { type: 'end', why, axes });
}

/** A press of the hold button, and the halt after it: on the lane, in order. */
export const laneMethods = {
  jog: `${AxisService.typeName}/Jog`, halt: `${AxisService.typeName}/Halt`, stop: `${AxisService.typeName}/Stop`,
};

// The page itself.

const leavers = new Set<(why: 'hidden' | 'page-hide') => void>();
/** Called before the page leaves the sight: whatever depends on being seen ends. */
export function onLeave(run: (why: 'hidden' | 'page-hide') => void): () => void {
  leavers.add(run);
  return () => leavers.delete(run);
}

function leave(why: 'hidden' | 'page-hide'): void {
  for (const run of [...leavers]) run(why);
  endControl('hidden');
  visible.value = false;
}

function start(): void {
  document.addEventListener('visibilitychange', () => {
    if (document.visibilityState === 'visible') visible.value = true;
    else leave('hidden');
  });
  document.addEventListener('freeze', () => leave('hidden'));
  document.addEventListener('resume', () => { visible.value = document.visibilityState === 'visible'; });
  addEventListener('pagehide', () => leave('page-hide'));
  addEventListener('pageshow', () => { visible.value = document.visibilityState === 'visible'; });
  for (const type of ['pointerdown', 'keydown'] as const) {
    addEventListener(type, () => {
      if (controlState.peek().leases.length > 0) drive({ type: 'touched', at: performance.now() });
    }, { capture: true, passive: true });
  }
  effect(() => { if (wanted.value) lane.start(); else lane.stop(); });
  effect(() => { if (wanted.value) void refreshMachine(); });
  effect(() => {
    if (session.value.at !== 'in') drive({ type: 'end', why: 'signed-out' });
  });
  effect(() => { if (states.state.value !== 'live') store.silent(performance.now()); });
  setInterval(() => {
    if (!visible.peek()) return;
    const now = performance.now();
    if (states.state.peek() !== 'live' || now - store.now.peek() > 4 * STREAM_MS) {
      store.now.value = now;
    }
  }, 250);
  // A gateway or a session that is gone is noticed without a reload, and so is its return.
  setInterval(() => {
    if (!visible.peek()) return;
    if (session.peek().at !== 'in' || states.state.peek() === 'lost') void refreshSession();
  }, 3000);
  setInterval(() => { if (wanted.peek()) void refreshLoad(); }, 5000);
  void refreshSession();
}

/** Loads of the buses, for the head of the page. */
async function refreshLoad(): Promise<void> {
  if (watchesBuses.peek() || states.state.peek() !== 'live') return;
  try {
    store.statistics.value = (await clients.buses.getBusStatistics({}, { timeoutMs: CALL_MS })).buses;
    store.info.value = await clients.system.getInfo({}, { timeoutMs: CALL_MS });
  } catch (error) { failed(error); }
}

start();
