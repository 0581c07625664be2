// An axis that is made up: it moves at once and evenly.
import { create } from '@bufbuild/protobuf';
import { timestampFromMs } from '@bufbuild/protobuf/wkt';
import { ErrorDetailSchema, Reason, type ErrorDetail } from '@proto/error_pb';
import { AxisStateSchema, CommandSchema, CommandState, CommandKind, LinkState, MotionCause, PositionSource, PositionTrust, State,
         StopHoldSchema, TerminalSchema, type AxisState, type Command } from '@proto/types_pb';

export interface Model {
  name: string; unit: string; bus: string; node: number; model: string; low: number | null; high: number | null; fastest: number;
  inputs: [string, string][]; outputs: [string, string][]; start: number; trust?: PositionTrust; offline?: string; fault?: ErrorDetail;
}

export const refusal = (reason: Reason, message: string, remedy = '', range?: [number, number, string]): ErrorDetail =>
  create(ErrorDetailSchema, { reason, message, remedy,
                              ...(range ? { permitted: { minimum: range[0], maximum: range[1], unit: range[2] } } : {}) });

export class FakeAxis {
  position: number;
  velocity = 0;
  target: number | null = null;
  state = State.DISABLED;
  trust: PositionTrust;
  fault: ErrorDetail | null;
  online: boolean;
  inhibited = false;
  leaseHolder = '';
  held: string[] = [];
  measured = Date.now();
  command: Command | null = null;
  /** When a jog ends unless it is renewed; and how often it was. */
  jogUntil = 0;
  renewals = 0;
  /** Way that was gone in all: the truth about motion. */
  gone = 0;

  constructor(readonly model: Model, private readonly changed: (axis: FakeAxis, before: State) => void,
              private readonly ended: (command: Command) => void) {
    this.position = model.start;
    this.trust = model.trust ?? PositionTrust.UNKNOWN;
    this.fault = model.fault ?? null;
    this.online = model.offline === undefined;
    if (this.fault !== null) this.state = State.ERROR_STOP;
  }

  get moving(): boolean { return this.velocity !== 0; }

  to(state: State): void {
    if (state === this.state) return;
    const before = this.state;
    this.state = state;
    this.changed(this, before);
  }

  end(state: CommandState, cause?: ErrorDetail): void {
    if (this.command === null) return;
    const command = create(CommandSchema, { ...this.command, state, endedAt: timestampFromMs(Date.now()), ...(cause ? { cause } : {}) });
    this.command = null;
    this.ended(command);
  }

  go(target: number, speed: number, state: State): void {
    this.target = target;
    this.velocity = Math.sign(target - this.position) * speed;
    if (this.velocity === 0) { this.end(CommandState.DONE); return; }
    this.to(state);
  }

  rest(): void {
    this.velocity = 0;
    this.target = null;
    this.jogUntil = 0;
    if (this.fault === null && this.state !== State.DISABLED) this.to(State.STANDSTILL);
  }

  /** Goes on for some milliseconds. */
  advance(ms: number, now: number): void {
    if (this.online) this.measured = now;
    if (!this.moving) return;
    const step = (this.velocity * ms) / 1000;
    const left = this.target === null ? Infinity : this.target - this.position;
    const over = Math.abs(step) >= Math.abs(left);
    this.gone += Math.abs(over ? left : step);
    this.position += over ? left : step;
    if (this.jogUntil !== 0 && now > this.jogUntil) {
      this.rest();
      this.end(CommandState.ABORTED, refusal(Reason.EXPIRED, 'the jog was not renewed'));
    } else if (over) {
      if (this.state === State.HOMING) this.trust = PositionTrust.HOMED;
      this.rest();
      this.end(CommandState.DONE);
    }
  }

  snapshot(now: number): AxisState {
    const { model } = this;
    const terminal = ([name, of]: [string, string]) => create(TerminalSchema, {
      name, function: of,
      active: of === 'positive_limit' ? model.high !== null && this.position >= model.high + 5
        : of === 'negative_limit' ? model.low !== null && this.position <= model.low - 5
        : of === 'home' ? Math.abs(this.position) < 2 : of === 'in_position' ? !this.moving && this.state === State.STANDSTILL : false });
    return create(AxisStateSchema, {
      axis: model.name, unit: model.unit, state: this.state, link: this.online ? LinkState.ONLINE : LinkState.OFFLINE,
      ...(this.online ? {} : { linkError: refusal(Reason.OFFLINE, model.offline ?? 'no reply', `check power, cable and address ${model.node}`) }),
      ...(this.fault === null ? {} : { fault: this.fault }), enabled: ![State.DISABLED, State.UNSPECIFIED].includes(this.state),
      enabledByDaemon: true, stopHeld: this.held.length > 0, inhibited: this.inhibited, position: this.position, velocity: this.velocity,
      ...(this.target === null ? {} : { target: this.target }), moving: this.moving, trust: this.trust,
      positionSource: PositionSource.COMMANDED, inputs: model.inputs.map(terminal), outputs: model.outputs.map(terminal),
      measuredAt: timestampFromMs(this.measured), age: { seconds: BigInt(Math.floor((now - this.measured) / 1000)), nanos: ((now - this.measured) % 1000) * 1e6 },
      simulated: true, commandId: this.command?.id ?? '', bus: model.bus, node: model.node, model: model.model,
      motionCause: this.moving ? MotionCause.COMMAND : MotionCause.NONE, leaseHolder: this.leaseHolder,
      holds: this.held.map((holder) => create(StopHoldSchema, { holder, since: timestampFromMs(now), durable: true })),
    });
  }
}

export { CommandKind };
