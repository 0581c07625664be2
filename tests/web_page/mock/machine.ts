// A machine that is made up, behind the services of the contract: enough of it to look at the page.
import { create } from '@bufbuild/protobuf';
import { timestampFromMs, type Timestamp } from '@bufbuild/protobuf/wkt';
import { Code, ConnectError } from '@connectrpc/connect';
import { ErrorDetailSchema, Reason, type ErrorDetail } from '@proto/error_pb';
import { EventSchema, InhibitChangeKind, LeaseChangeKind, type Event } from '@proto/event_service_pb';
import { CommandKind, CommandSchema, CommandState, PositionTrust, State, type Command, type CommandOptions, type MotionValues } from '@proto/types_pb';
import { FakeAxis, refusal, type Model } from './axis';

export interface FakeLease { token: bigint; client: string; label: string; axes: string[]; ttl: number; until: number }

const stamp = (): Timestamp => timestampFromMs(Date.now());

export class Refused extends ConnectError {
  constructor(readonly detail: ErrorDetail, code = Code.FailedPrecondition) {
    super(detail.message, code, undefined, [{ desc: ErrorDetailSchema, value: detail }]);
  }
}

export class FakeMachine {
  readonly axes = new Map<string, FakeAxis>();
  readonly events: Event[] = [];
  readonly commands: Command[] = [];
  readonly leases = new Map<bigint, FakeLease>();
  readonly instance = `mock-${Date.now()}`;
  inhibitedBy = '';
  readonly client = 'shift-a';
  private readonly requests = new Map<string, Command>();
  private tokens = 100n;
  private nextCommand = 1;
  private readonly timer: ReturnType<typeof setInterval>;
  private last = Date.now();

  constructor(models: readonly Model[]) {
    for (const model of models) {
      this.axes.set(model.name, new FakeAxis(model, (axis, from) => this.tell(axis.model.name, { case: 'stateChange', value: { from, to: axis.state } as never }),
                                             (command) => this.remember(command, true)));
    }
    this.timer = setInterval(() => this.advance(), 10);
  }

  close(): void { clearInterval(this.timer); }

  private advance(): void {
    const now = Date.now();
    for (const axis of this.axes.values()) axis.advance(now - this.last, now);
    for (const lease of [...this.leases.values()]) if (now > lease.until) this.endLease(lease, LeaseChangeKind.EXPIRED);
    this.last = now;
  }

  tell(axis: string, content: Event['content']): void {
    this.events.push(create(EventSchema, { sequence: BigInt(this.events.length + 1), at: stamp(), axis, content }));
  }

  remember(command: Command, ended: boolean): void {
    const index = this.commands.findIndex(({ id }) => id === command.id);
    if (index < 0) this.commands.unshift(command);
    else this.commands[index] = command;
    void ended;
    this.tell(command.axis, { case: 'commandChange', value: { command } as never });
  }

  axis(name: string): FakeAxis {
    const axis = this.axes.get(name);
    if (axis === undefined) throw new Refused(refusal(Reason.UNKNOWN_AXIS, `no axis '${name}'`), Code.NotFound);
    return axis;
  }

  /** What stands in the way, in order. */
  obstacles(name: string, kind: CommandKind, asked: { position?: number; velocity?: number }, token: bigint): ErrorDetail[] {
    const axis = this.axis(name);
    const { model } = axis;
    const found: ErrorDetail[] = [];
    const lease = [...this.leases.values()].find(({ axes }) => axes.includes(name));
    if (lease !== undefined && lease.token !== token) found.push(refusal(Reason.LEASE_REQUIRED, `${name} is leased by ${lease.client}, for ${((lease.until - Date.now()) / 1000).toFixed(1)} s still`));
    if (!axis.online) found.push(refusal(Reason.OFFLINE, `${model.name}: ${model.offline}`, `check power, cable and address ${model.node}`));
    if (this.inhibitedBy !== '') found.push(refusal(Reason.INHIBITED, `StopAll of ${this.inhibitedBy} holds the machine`, 'axisctl release-stop --all'));
    if (axis.held.length > 0) found.push(refusal(Reason.STOPPING, `a stop is held by ${axis.held.join(', ')}`, `axisctl release-stop ${name}`));
    if (kind === CommandKind.RESET) {
      if (axis.fault === null) found.push(refusal(Reason.FAULT, 'there is no fault to reset'));
      return found;
    }
    if (axis.fault !== null && kind !== CommandKind.DISABLE) found.push(refusal(Reason.FAULT, `${name} is in ErrorStop: ${axis.fault.message}`, `axisctl reset ${name}`));
    if (kind === CommandKind.ENABLE || kind === CommandKind.DISABLE) return found;
    if (axis.state === State.DISABLED) found.push(refusal(Reason.DISABLED, 'the power stage is off', `axisctl enable ${name}`));
    if (kind === CommandKind.MOVE_ABSOLUTE && axis.trust === PositionTrust.UNKNOWN) {
      found.push(refusal(Reason.NOT_TRUSTED, 'the position is unknown: home the axis', `axisctl home ${name}`));
    }
    if (asked.velocity !== undefined && (Math.abs(asked.velocity) > model.fastest || Math.abs(asked.velocity) < 0.1)) {
      found.push(refusal(Reason.OUT_OF_RANGE, `velocity ${Math.abs(asked.velocity)} ${model.unit}/s is out of range`, '', [0.1, model.fastest, `${model.unit}/s`]));
    }
    if (kind === CommandKind.MOVE_ABSOLUTE && asked.position !== undefined && model.low !== null && model.high !== null &&
        (asked.position < model.low || asked.position > model.high)) {
      found.push(refusal(Reason.SOFT_LIMIT, `target ${asked.position} ${model.unit} is beyond a software limit`, 'choose a target within the limits', [model.low, model.high, model.unit]));
    }
    return found;
  }

  /** Accepts a command, or refuses it with the first obstacle. */
  accept(name: string, kind: CommandKind, options: CommandOptions | undefined, asked: Partial<MotionValues>): Command {
    const known = options?.requestId ? this.requests.get(options.requestId) : undefined;
    if (known !== undefined && kind !== CommandKind.STOP && kind !== CommandKind.HALT) {
      return this.commands.find(({ id }) => id === known.id) ?? known;
    }
    const axis = this.axis(name);
    if (kind !== CommandKind.STOP && kind !== CommandKind.HALT) {
      if (options?.notAfter !== undefined && Number(options.notAfter.seconds) * 1000 + options.notAfter.nanos / 1e6 < Date.now()) {
        throw new Refused(refusal(Reason.EXPIRED, 'the request\'s validity has passed'), Code.DeadlineExceeded);
      }
      const [first] = this.obstacles(name, kind, asked, options?.leaseToken ?? 0n);
      if (first !== undefined) throw new Refused(first);
    }
    axis.end(CommandState.ABORTED, refusal(Reason.SUPERSEDED, 'a newer command took its place'));
    const velocity = asked.velocity ?? axis.model.fastest / 2;
    const command = create(CommandSchema, {
      id: `c-${this.nextCommand++}`, axis: name, kind, state: CommandState.ACTIVE, requestId: options?.requestId ?? '', client: this.client,
      acceptedAt: stamp(), startedAt: stamp(), asked: { ...asked } as never,
      granted: { ...asked, velocity, accelerationTime: { seconds: 0n, nanos: 1e6 }, decelerationTime: { seconds: 0n, nanos: 1e6 } } as never });
    if (options?.requestId) this.requests.set(options.requestId, command);
    axis.command = command;
    this.remember(command, false);
    return command;
  }

  lease(axes: string[], ttl: number, label: string, take: boolean): FakeLease {
    const others = [...this.leases.values()].filter((lease) => lease.axes.some((axis) => axes.includes(axis)));
    if (others.length > 0 && !take) {
      const [first] = others;
      throw new Refused(refusal(Reason.LEASE_REQUIRED, `${axes[0]} is leased by ${first!.client} ${first!.label}`), Code.PermissionDenied);
    }
    for (const other of others) this.endLease(other, LeaseChangeKind.TAKEN);
    const lease = { token: ++this.tokens, client: this.client, label, axes, ttl, until: Date.now() + ttl };
    this.leases.set(lease.token, lease);
    for (const name of axes) {
      this.axis(name).leaseHolder = `${lease.client} ${label}`;
      this.tell(name, { case: 'leaseChange', value: { kind: LeaseChangeKind.ACQUIRED, holder: lease.client, before: '' } as never });
    }
    return lease;
  }

  endLease(lease: FakeLease, kind: LeaseChangeKind): void {
    this.leases.delete(lease.token);
    for (const name of lease.axes) {
      const axis = this.axis(name);
      axis.leaseHolder = '';
      if (axis.moving) { axis.rest(); axis.end(CommandState.ABORTED, refusal(Reason.LEASE_LOST, 'the lease is over')); }
      this.tell(name, { case: 'leaseChange', value: { kind, holder: '', before: lease.client } as never });
    }
  }

  stop(name: string, kind: CommandKind, options?: CommandOptions): Command {
    const axis = this.axis(name);
    const command = this.accept(name, kind, options, {});
    axis.rest();
    axis.end(CommandState.DONE);
    return this.commands.find(({ id }) => id === command.id)!;
  }

  stopAll(by: string): Command[] {
    this.inhibitedBy = by;
    this.tell('', { case: 'inhibitChange', value: { kind: InhibitChangeKind.LATCHED, by } as never });
    return [...this.axes.values()].map((axis) => { axis.inhibited = true; return this.stop(axis.model.name, CommandKind.STOP); });
  }

  releaseAll(by: string): void {
    this.inhibitedBy = '';
    for (const axis of this.axes.values()) axis.inhibited = false;
    this.tell('', { case: 'inhibitChange', value: { kind: InhibitChangeKind.RELEASED, by } as never });
  }

  jog(name: string, velocity: number, hold: number, options: CommandOptions | undefined): Command {
    const axis = this.axis(name);
    const repeated = options?.requestId !== undefined && this.requests.has(options.requestId);
    if (repeated) {
      const lease = [...this.leases.values()].find(({ axes }) => axes.includes(name));
      if (lease !== undefined && lease.token !== options?.leaseToken) throw new Refused(refusal(Reason.LEASE_LOST, 'the lease is over'));
    }
    const command = this.accept(name, CommandKind.JOG, options, { velocity });
    if (axis.command?.id !== command.id) return command;
    axis.renewals += 1;
    axis.jogUntil = Date.now() + hold;
    const far = velocity > 0 ? axis.model.high ?? Infinity : axis.model.low ?? -Infinity;
    if (!axis.moving) axis.go(Number.isFinite(far) ? far : axis.position + Math.sign(velocity) * 1e6, Math.abs(velocity), State.CONTINUOUS_MOTION);
    return command;
  }
}

const inputs = (...list: [string, string][]): [string, string][] => list;

/** Six axes in six situations. */
export const models: readonly Model[] = [
  { name: 'feeder', unit: 'mm', bus: 'line-a', node: 1, model: 'ykd2405pr', low: 0, high: 400, fastest: 100, start: 120, trust: PositionTrust.HOMED,
    inputs: inputs(['X0', 'home'], ['X1', 'positive_limit'], ['X2', 'negative_limit'], ['X3', '']), outputs: inputs(['Y0', 'alarm'], ['Y1', 'in_position']) },
  { name: 'lifter', unit: 'mm', bus: 'line-a', node: 2, model: 'ykd2405pr', low: 0, high: 250, fastest: 200, start: 30, offline: 'no reply from node 2 on line-a',
    inputs: inputs(['X0', 'negative_limit'], ['X1', 'positive_limit']), outputs: inputs(['Y0', 'brake']) },
  { name: 'carousel', unit: 'deg', bus: 'line-a', node: 3, model: 'ykd2405pr', low: null, high: null, fastest: 180, start: 41.2,
    inputs: inputs(['X0', 'home']), outputs: inputs(['Y0', 'in_position']) },
  { name: 'pusher', unit: 'mm', bus: 'line-b', node: 1, model: 'ssd2608pr', low: -50, high: 50, fastest: 40, start: 0, trust: PositionTrust.SET,
    inputs: inputs(['X0', 'stop'], ['X1', 'positive_limit']), outputs: inputs(['Y0', 'alarm']), },
  { name: 'gripper', unit: 'mm', bus: 'line-b', node: 2, model: 'ess42-r', low: 0, high: 60, fastest: 30, start: 12.5,
    fault: refusal(Reason.ALARM, 'drive alarm 5: position error too large', 'look for a blocked mechanism, then reset'),
    inputs: inputs(['X0', 'home']), outputs: inputs(['Y0', 'alarm']) },
  { name: 'turntable', unit: 'deg', bus: 'can0', node: 5, model: 'yss-c', low: null, high: null, fastest: 360, start: 271.35, trust: PositionTrust.RESTORED,
    inputs: inputs(['X0', 'home'], ['X1', 'positive_limit']), outputs: inputs(['Y0', 'in_position']) },
];
