// Carries out what the hold-to-run machine says, for one axis, on the lane.
import { signal } from '@preact/signals';
import { create, toBinary } from '@bufbuild/protobuf';
import { HaltRequestSchema, JogRequestSchema } from '@proto/axis_service_pb';
import { lane, laneMethods, onLeave, store, tokenFor } from '../app';
import { Kind, type Answer } from '../lane/frame';
import { detailOf, duration, timestamp } from '../model/wire';
import { clients } from '../transport/clients';
import { HOLD_MS, idle, step, type Effect, type Event, type Loss, type Source, type State } from './machine';

const VALID_MS = 1000;
/** While held, states have to arrive at least so often. */
const SEEN_MS = 1000;

export class Holder {
  readonly state = signal<State>(idle);
  /** Why the last hold ended by itself, and what the daemon said. */
  readonly said = signal<{ loss: Loss; text: string } | null>(null);
  private refusal = '';
  private painting = 0;
  /** Presses whose first answer is awaited, and those that have ended meanwhile. */
  private readonly starting = new Map<string, 'held' | 'ended'>();
  private readonly forget: (() => void)[] = [];

  constructor(private readonly axis: string, private readonly capture: (pointer: number) => void) {
    this.forget.push(lane.onLost(() => this.dispatch({ type: 'loss', loss: 'lane-lost' })));
    this.forget.push(onLeave((why) => this.dispatch({ type: 'loss', loss: why })));
    this.forget.push(store.live.subscribe((live) => { if (!live) this.dispatch({ type: 'loss', loss: 'not-live' }); }));
    const blurred = () => this.dispatch({ type: 'loss', loss: 'blur' });
    addEventListener('blur', blurred);
    this.forget.push(() => removeEventListener('blur', blurred));
  }

  /** The screen is left. */
  close(): void {
    this.dispatch({ type: 'loss', loss: 'hidden' });
    for (const run of this.forget) run();
    cancelAnimationFrame(this.painting);
  }

  press(source: Source, alone: boolean, velocity: number, made: number, blocked: Loss | null): void {
    this.dispatch({ type: 'press', at: performance.now(), made, source, alone, press: crypto.randomUUID(), velocity,
                    lane: lane.takes(), blocked });
  }

  dispatch(event: Event): void {
    const before = this.state.peek();
    const { state, effects } = step(before, event);
    if (state !== before) this.state.value = state;
    if (before.at === 'held' && state.at !== 'held' && this.starting.has(before.press)) this.starting.set(before.press, 'ended');
    for (const effect of effects) this.carryOut(effect);
    if (state.at === 'held') this.paint();
  }

  private carryOut(effect: Effect): void {
    switch (effect.do) {
      case 'capture': this.capture(effect.pointer); break;
      case 'jog': this.jog(effect.press, effect.velocity, effect.sent); break;
      case 'halt': this.halt(); break;
      case 'say': this.said.value = { loss: effect.loss, text: this.refusal }; break;
    }
  }

  private paint(): void {
    if (this.painting !== 0) return;
    // The time of the frame itself may be that of before a hang.
    this.painting = requestAnimationFrame(() => {
      this.painting = 0;
      const now = performance.now();
      // Nobody moves what they do not see.
      if (now - (store.axis(this.axis)?.received ?? -Infinity) > SEEN_MS) this.dispatch({ type: 'loss', loss: 'not-live' });
      this.dispatch({ type: 'frame', at: now });
    });
  }

  private jog(press: string, velocity: number, sent: number): void {
    const token = tokenFor(this.axis);
    const now = store.clock.at(performance.now());
    if (token === 0n || now === null) { this.dispatch({ type: 'loss', loss: token === 0n ? 'control-lost' : 'not-live' }); return; }
    const state = this.state.peek();
    const first = state.at === 'held' && !state.started && !this.starting.has(press);
    if (first) { this.starting.set(press, 'held'); this.said.value = null; this.refusal = ''; }
    const message = create(JogRequestSchema, {
      axis: this.axis, velocity, hold: duration(HOLD_MS),
      options: { requestId: press, leaseToken: token, notAfter: timestamp(now + VALID_MS) },
    });
    lane.call(laneMethods.jog, toBinary(JogRequestSchema, message)).then((answer) => this.answered(press, sent, answer))
      .catch(() => this.dispatch({ type: 'loss', loss: 'lane-lost' }));
  }

  private answered(press: string, sent: number, answer: Answer): void {
    const outcome = answer.kind === Kind.droppedAsLate ? 'dropped' : answer.kind === Kind.answer && answer.status === 0 ? 'ok' : 'refused';
    if (this.starting.get(press) === 'ended' && outcome === 'ok') this.halt();
    this.starting.delete(press);
    if (outcome === 'refused') this.refusal = detailOf(answer.details)?.message ?? answer.message;
    this.dispatch({ type: 'answer', press, sent, outcome });
  }

  /** By the lane, behind the jog; where that is closed the gateway halts too, and this makes certain. */
  private halt(): void {
    const message = create(HaltRequestSchema, { axis: this.axis, options: { requestId: crypto.randomUUID() } });
    lane.call(laneMethods.halt, toBinary(HaltRequestSchema, message)).catch(() => {
      clients.axes.halt(message, { timeoutMs: 2000 }).catch(() => {});
    });
  }
}
