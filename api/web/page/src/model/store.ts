// What this page knows of the machine: the latest states as they come, and how old they are.
import { batch, computed, signal, type ReadonlySignal, type Signal } from '@preact/signals';
import type { AxisState } from '@proto/types_pb';
import { LinkState } from '@proto/types_pb';
import type { Event as MachineEvent } from '@proto/event_service_pb';
import type { Command } from '@proto/types_pb';
import type { Bus, BusStatistics } from '@proto/bus_service_pb';
import type { BusBudget } from '@proto/budget_pb';
import type { GetInfoResponse } from '@proto/system_service_pb';
import { ageNow, PollMeter, ServerClock, staleAfter } from './fresh';
import { Recorder, MOST_RECORDS, type Record, type Trigger } from './record';
import { Series } from './series';
import { instant, milliseconds, sampleOf } from './wire';

export const STREAM_MS = 50;
const MOST_RECORDED_SAMPLES = 100_000;
const MOST_EVENTS = 1000;
const MOST_COMMANDS = 500;

export class AxisEntry {
  readonly state: Signal<AxisState>;
  readonly series = new Series();
  readonly recorder: Recorder;
  readonly polls = new PollMeter();
  /** By performance.now(). */
  received = 0;

  constructor(readonly name: string, first: AxisState, store: Store) {
    this.state = signal(first);
    this.recorder = new Recorder(this.series, (record) => store.recorded(this, record));
    this.age = computed(() => ageNow(milliseconds(this.state.value.age) ?? Infinity, this.received, store.now.value));
    this.stale = computed(() => {
      const { moving, link } = this.state.value;
      return !store.live.value || link !== LinkState.ONLINE || this.age.value > staleAfter(STREAM_MS, this.polls.period(moving));
    });
  }

  /** Milliseconds since the drive answered. */
  readonly age: ReadonlySignal<number>;
  /** It may not be shown as live. */
  readonly stale: ReadonlySignal<boolean>;
}

export class Store {
  /** A clock for ages: set with each batch, and four times a second where none comes. */
  readonly now = signal(0);
  readonly live = signal(false);
  readonly names = signal<readonly string[]>([]);
  readonly instance = signal('');
  readonly dropped = signal(0n);
  readonly info = signal<GetInfoResponse | null>(null);
  readonly events = signal<readonly MachineEvent[]>([]);
  readonly commands = signal<readonly Command[]>([]);
  readonly buses = signal<readonly Bus[]>([]);
  readonly budgets = signal<readonly BusBudget[]>([]);
  readonly statistics = signal<readonly BusStatistics[]>([]);
  readonly records = signal<readonly Record[]>([]);
  readonly trigger = signal<Trigger>({ on: 'motion' });
  /** How long a trigger records. */
  readonly after = signal(2000);
  readonly clock = new ServerClock();
  /** STOP ALL holds the machine, as the axes tell it. */
  readonly inhibited = computed(() => {
    this.tick.value;
    for (const { state } of this.axes.values()) if (state.peek().inhibited) return true;
    return this.info.value?.inhibited ?? false;
  });
  /** Counts the batches: what is drawn anew, is drawn with them. */
  readonly tick = signal(0);
  private readonly axes = new Map<string, AxisEntry>();
  private nextRecord = 1;

  axis(name: string): AxisEntry | undefined { return this.axes.get(name); }

  /** A batch of the stream of states. */
  take(states: readonly AxisState[], instance: string, dropped: bigint, at: number): void {
    batch(() => {
      if (instance !== this.instance.peek()) { this.instance.value = instance; this.clock.forget(); }
      this.now.value = at;
      this.live.value = true;
      this.dropped.value = dropped;
      this.tick.value += 1;
      for (const state of states) this.takeState(state, at);
      const names = states.map(({ axis }) => axis);
      const before = this.names.peek();
      if (names.length !== before.length || names.some((name, index) => name !== before[index])) {
        this.names.value = names;
        for (const name of this.axes.keys()) if (!names.includes(name)) this.axes.delete(name);
      }
    });
  }

  /** Without a stream nothing is live. */
  silent(at: number): void {
    batch(() => { this.live.value = false; this.now.value = at; });
  }

  private takeState(state: AxisState, at: number): void {
    const measured = instant(state.measuredAt);
    const age = milliseconds(state.age);
    if (measured !== null && age !== null) this.clock.heard(measured + age, at);
    let entry = this.axes.get(state.axis);
    if (entry === undefined) {
      entry = new AxisEntry(state.axis, state, this);
      this.axes.set(state.axis, entry);
    }
    entry.received = at;
    entry.state.value = state;
    const sample = sampleOf(state);
    if (sample !== null && state.link === LinkState.ONLINE && entry.series.push(sample)) {
      entry.polls.read(sample.at, sample.moving);
      const trigger = this.trigger.peek();
      entry.recorder.feed(sample, trigger, trigger.on === 'edge' ? trigger.name : trigger.on === 'level' ? trigger.quantity : '',
                          this.after.peek());
    }
  }

  recorded(entry: AxisEntry, record: Omit<Record, 'id' | 'axis' | 'unit'>): void {
    const whole = { ...record, id: this.nextRecord++, axis: entry.name, unit: entry.state.peek().unit };
    // As many as there is room for, the newest in any case.
    let room = MOST_RECORDED_SAMPLES;
    this.records.value = [whole, ...this.records.peek()].slice(0, MOST_RECORDS)
      .filter(({ id, samples }) => { room -= samples.length; return room >= 0 || id === whole.id; });
  }

  heardEvents(events: readonly MachineEvent[], anew: boolean): void {
    const all = [...[...events].reverse(), ...(anew ? [] : this.events.peek())].slice(0, MOST_EVENTS);
    const changed = events.flatMap(({ content }) =>
      content.case === 'commandChange' && content.value.command !== undefined ? [content.value.command] : []);
    batch(() => {
      this.events.value = all;
      if (changed.length > 0 || anew) this.mergeCommands(changed, anew);
    });
  }

  /** Newest first, each as it stood last. */
  mergeCommands(changed: readonly Command[], anew = false): void {
    const commands = new Map((anew ? [] : [...this.commands.peek()].reverse()).map((command) => [command.id, command]));
    for (const command of changed) {
      const before = commands.get(command.id);
      // A list that was asked for meanwhile may be older than the event.
      if (before?.endedAt !== undefined && command.endedAt === undefined) continue;
      commands.set(command.id, command);
    }
    const sorted = [...commands.values()].sort((a, b) => (instant(b.acceptedAt) ?? 0) - (instant(a.acceptedAt) ?? 0));
    this.commands.value = sorted.slice(0, MOST_COMMANDS);
  }
}
