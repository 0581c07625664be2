// Commands of this page. Each is sent once, over the lane, under the page's lease, valid for two seconds by the daemon's clock:
// one that is held up on its way is dropped by the gateway, and one that is held up there refused by the daemon.
import { BufferMode, CommandState, WaitUntil, type Command } from '@proto/types_pb';
import type { CommandOptionsSchema } from '@proto/types_pb';
import type { MessageInitShape } from '@bufbuild/protobuf';
import type { DescMessage, DescMethodUnary } from '@bufbuild/protobuf';
import { AxisService } from '@proto/axis_service_pb';
import { GroupService, type GroupMove, type GroupTarget } from '@proto/group_service_pb';
import { lane, store, tokenFor } from './app';
import { byLane, NoAnswer } from './lane/calls';
import { timestamp } from './model/wire';
import { CALL_MS, clients, problem } from './transport/clients';
import { notify, settle, type Text } from './ui/notices';
import { reasonKey } from './i18n/names';
import { t, type Key } from './i18n';

const VALID_MS = 2000;

/** Null: the daemon's clock is not known, as nothing is live. */
export function options(token: bigint): MessageInitShape<typeof CommandOptionsSchema> | null {
  const now = store.clock.at(performance.now());
  if (now === null) return null;
  return { requestId: crypto.randomUUID(), leaseToken: token, notAfter: timestamp(now + VALID_MS),
           bufferMode: BufferMode.ABORTING, waitUntil: WaitUntil.ACCEPTED };
}

const endings: { [state: number]: { level: 'done' | 'warning' | 'error'; key: Key } } = {
  [CommandState.DONE]: { level: 'done', key: 'command.done' },
  [CommandState.ABORTED]: { level: 'warning', key: 'command.aborted' },
  [CommandState.ERROR]: { level: 'error', key: 'command.error' },
  [CommandState.UNKNOWN]: { level: 'error', key: 'command.unknown' },
};

/** Shows what becomes of a command until it has ended. */
async function follow(id: number, what: string, command: Command): Promise<void> {
  const shown = (now: Command): boolean => {
    const ending = endings[now.state];
    if (ending === undefined) return false;
    settle(id, ending.level, { key: ending.key, values: { what } }, now.cause?.message);
    return true;
  };
  if (shown(command)) return;
  store.mergeCommands([command]);
  const unsubscribe = store.commands.subscribe((commands) => {
    const now = commands.find((known) => known.id === command.id);
    // The store keeps the newest: one that is not there any more ended long ago.
    if (now === undefined || shown(now)) queueMicrotask(() => unsubscribe());
  });
}

/** Calls, and says what came of it. */
async function commanded(what: string, call: () => Promise<Command | undefined>): Promise<boolean> {
  const id = notify('busy', { key: 'command.sent', values: { what } });
  try {
    const command = await call();
    if (command === undefined) throw new Error('no command in the answer');
    settle(id, 'busy', { key: 'command.accepted', values: { what } });
    void follow(id, what, command);
    return true;
  } catch (error) {
    refused(id, what, error);
    return false;
  }
}

function refused(id: number, what: string, error: unknown): void {
  settle(id, 'error', { key: error instanceof NoAnswer ? 'command.unknown' : 'command.refused', values: { what } }, wordsOf(error));
}

const reasonWord = (reason: number): string => { const key = reasonKey(reason); return key === null ? '' : t(key); };

function wordsOf(error: unknown): string {
  const detail = problem(error);
  return [reasonWord(detail.reason), detail.message, detail.remedy].filter(Boolean).join(': ');
}

const start = <I extends DescMessage, O extends DescMessage>(method: DescMethodUnary<I, O>, request: MessageInitShape<I>) =>
  byLane(lane, method, request);
const needed = (token: bigint) => {
  const given = options(token);
  if (given === null) throw new Error(t('page.nothing-live'));
  return given;
};

export const enable = (axis: string) => commanded(`${t('action.enable')} ${axis}`, async () =>
  (await start(AxisService.method.enable, { axis, options: needed(tokenFor(axis)) })).command);
export const disable = (axis: string) => commanded(`${t('action.disable')} ${axis}`, async () =>
  (await clients.axes.disable({ axis, options: needed(tokenFor(axis)) }, { timeoutMs: CALL_MS })).command);
export const home = (axis: string) => commanded(`${t('action.home')} ${axis}`, async () =>
  (await start(AxisService.method.home, { axis, options: needed(tokenFor(axis)) })).command);
export const reset = (axis: string) => commanded(`${t('action.reset')} ${axis}`, async () =>
  (await start(AxisService.method.reset, { axis, options: needed(tokenFor(axis)) })).command);
export const moveTo = (axis: string, position: number, velocity: number | undefined, unit: string) =>
  commanded(`${t('action.move')} ${axis} ${position} ${unit}`, async () => (await start(AxisService.method.moveAbsolute,
    { axis, position, ...(velocity === undefined ? {} : { velocity }), options: needed(tokenFor(axis)) })).command);
export const moveBy = (axis: string, distance: number, velocity: number | undefined, unit: string) =>
  commanded(`${t('action.move')} ${axis} ${distance > 0 ? '+' : ''}${distance} ${unit}`, async () => (await start(AxisService.method.moveRelative,
    { axis, distance, ...(velocity === undefined ? {} : { velocity }), options: needed(tokenFor(axis)) })).command);

/** A move of several axes. Null: it was refused, and said so. */
export async function moveGroup(group: string, targets: readonly Omit<GroupTarget, '$typeName' | '$unknown'>[], together: boolean,
                                token: bigint): Promise<GroupMove | null> {
  const what = `${t('action.move')} ${group}`;
  const id = notify('busy', { key: 'command.sent', values: { what } });
  try {
    const { move } = await start(GroupService.method.moveGroup, {
      group, targets: targets.map((target) => ({ ...target })), arriveTogether: together, options: needed(token) });
    settle(id, 'busy', { key: 'command.accepted', values: { what } });
    return move ?? null;
  } catch (error) {
    refused(id, what, error);
    return null;
  }
}

/** Anything else that is asked of the daemon by a button: it says what came of it. */
export async function asked(what: Text, call: () => Promise<unknown>): Promise<boolean> {
  const id = notify('busy', what);
  try {
    await call();
    settle(id, 'done', what);
    return true;
  } catch (error) {
    settle(id, 'error', what, wordsOf(error));
    return false;
  }
}
