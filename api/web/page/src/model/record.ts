// Recording: which stretch of the samples is worth keeping. Each motion is recorded from one second before its start;
// beside that a trigger may wait for an edge, a level or a fault.
import type { Sample, Series } from './series';

export const BEFORE_MS = 1000;
export const AFTER_MS = 300;
export const MOST_RECORDS = 40;

export interface Record {
  id: number;
  axis: string;
  unit: string;
  /** When it was triggered. */
  at: number;
  why: 'motion' | 'edge' | 'level' | 'fault';
  /** Of the trigger: a terminal, a quantity; empty: the motion itself. */
  detail: string;
  samples: readonly Sample[];
}

export type Trigger =
  | { on: 'motion' }
  | { on: 'edge'; terminal: number; name: string; rising: boolean }
  | { on: 'level'; quantity: 'position' | 'velocity' | 'error'; level: number; rising: boolean }
  | { on: 'fault' };

const ERROR_STOP = 8;

/** Whether a trigger fires between two samples that follow each other. */
export function fires(trigger: Trigger, before: Sample | null, now: Sample): boolean {
  switch (trigger.on) {
    case 'motion': return now.moving && !before?.moving;
    case 'fault': return before !== null && now.state === ERROR_STOP && before.state !== ERROR_STOP;
    case 'edge': {
      if (before === null) return false;
      const bit = (sample: Sample) => (sample.terminals >>> trigger.terminal) & 1;
      return trigger.rising ? bit(before) === 0 && bit(now) === 1 : bit(before) === 1 && bit(now) === 0;
    }
    case 'level': {
      if (before === null) return false;
      const last = before[trigger.quantity];
      const value = now[trigger.quantity];
      return trigger.rising ? last < trigger.level && value >= trigger.level : last > trigger.level && value <= trigger.level;
    }
  }
}

interface Open { at: number; why: Record['why']; detail: string; end: number | null }

/** Watches the samples of one axis, and hands out what was recorded. */
export class Recorder {
  private before: Sample | null = null;
  private motion: Open | null = null;
  private triggered: Open | null = null;

  constructor(private readonly series: Series, private readonly done: (record: Omit<Record, 'id' | 'axis' | 'unit'>) => void) {}

  /** Looks at a sample that the series has just taken. `after`: how long a trigger goes on recording. */
  feed(sample: Sample, trigger: Trigger, detail: string, after: number): void {
    if (fires({ on: 'motion' }, this.before, sample)) {
      // A new motion before the last one was closed belongs to it.
      this.motion ??= { at: sample.at, why: 'motion', detail: '', end: null };
      this.motion.end = null;
    }
    if (this.motion !== null && this.motion.end === null && !sample.moving) this.motion.end = sample.at + AFTER_MS;
    if (trigger.on !== 'motion' && this.triggered === null && fires(trigger, this.before, sample)) {
      this.triggered = { at: sample.at, why: trigger.on, detail, end: sample.at + after };
    }
    this.motion = this.close(this.motion, sample.at);
    this.triggered = this.close(this.triggered, sample.at);
    this.before = sample;
  }

  private close(open: Open | null, now: number): Open | null {
    if (open === null || open.end === null || now < open.end) return open;
    this.done({ at: open.at, why: open.why, detail: open.detail, samples: this.series.span(open.at - BEFORE_MS, open.end) });
    return null;
  }
}
