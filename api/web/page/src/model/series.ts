// What was seen of an axis: the samples of the last ten minutes, as they came.

export const KEPT_MS = 10 * 60 * 1000;

export interface Sample {
  /** When the drive answered: milliseconds since 1970, with fractions. */
  at: number;
  position: number;
  velocity: number;
  /** Not a number: there is none. */
  target: number;
  /** Not a number: the drive tells none. */
  error: number;
  moving: boolean;
  state: number;
  /** Inputs, then outputs: bit i is that of the i-th terminal. */
  terminals: number;
}

const FIRST = 256;

/** A ring that grows as it needs, and forgets what is older than ten minutes. Thread: the page's only one. */
export class Series {
  private capacity: number;
  private first = 0;
  private count = 0;
  private columns;

  constructor(private readonly most = 13_000) {
    this.capacity = Math.min(FIRST, most);
    this.columns = Series.make(this.capacity);
  }

  private static make(size: number) {
    const numbers = () => new Float64Array(size);
    return { at: numbers(), position: numbers(), velocity: numbers(), target: numbers(), error: numbers(),
             flags: new Uint32Array(size), terminals: new Uint32Array(size) };
  }

  get length(): number { return this.count; }

  /** Keeps a sample; one that is not newer than the last is the same reading again. */
  push(sample: Sample): boolean {
    if (this.count > 0 && sample.at <= this.at(this.count - 1)) return false;
    if (this.count === this.capacity && this.capacity < this.most) this.grow();
    if (this.count === this.capacity) this.drop();
    const slot = (this.first + this.count) % this.capacity;
    const { columns } = this;
    columns.at[slot] = sample.at;
    columns.position[slot] = sample.position;
    columns.velocity[slot] = sample.velocity;
    columns.target[slot] = sample.target;
    columns.error[slot] = sample.error;
    columns.flags[slot] = (sample.moving ? 1 : 0) | (sample.state << 1);
    columns.terminals[slot] = sample.terminals;
    this.count += 1;
    while (this.count > 1 && this.at(0) < sample.at - KEPT_MS) this.drop();
    return true;
  }

  at(index: number): number { return this.columns.at[(this.first + index) % this.capacity]!; }

  sample(index: number): Sample {
    const slot = (this.first + index) % this.capacity;
    const { columns } = this;
    return { at: columns.at[slot]!, position: columns.position[slot]!, velocity: columns.velocity[slot]!,
             target: columns.target[slot]!, error: columns.error[slot]!, moving: (columns.flags[slot]! & 1) === 1,
             state: columns.flags[slot]! >>> 1, terminals: columns.terminals[slot]! };
  }

  /** Index of the first sample that is not older; `length` where all are. */
  find(at: number): number {
    let low = 0;
    let high = this.count;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.at(middle) < at) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** Copies of what lies in a span of time, both ends included. */
  span(from: number, to: number): Sample[] {
    const samples: Sample[] = [];
    for (let index = this.find(from); index < this.count && this.at(index) <= to; ++index) samples.push(this.sample(index));
    return samples;
  }

  private drop(): void {
    this.first = (this.first + 1) % this.capacity;
    this.count -= 1;
  }

  private grow(): void {
    const size = Math.min(this.capacity * 2, this.most);
    const next = Series.make(size);
    for (const key of Object.keys(next) as (keyof typeof next)[]) {
      for (let index = 0; index < this.count; ++index) {
        next[key][index] = this.columns[key][(this.first + index) % this.capacity]!;
      }
    }
    this.columns = next;
    this.capacity = size;
    this.first = 0;
  }
}

export type Quantity = 'position' | 'velocity' | 'target' | 'error';

export interface Trace { at: number[]; value: (number | null)[] }

/** A quantity for drawing: of each of `columns` stretches of time the first, lowest, highest and last sample. */
export function thin(samples: { length: number; at(index: number): number; sample(index: number): Sample; find(at: number): number },
                     quantity: Quantity, from: number, to: number, columns: number): Trace {
  const trace: Trace = { at: [], value: [] };
  const begin = Math.max(0, samples.find(from) - 1);
  const end = Math.min(samples.length, samples.find(to) + 1);
  const keep = (index: number) => {
    const value = samples.sample(index)[quantity];
    trace.at.push(samples.at(index));
    trace.value.push(Number.isNaN(value) ? null : value);
  };
  if (end - begin <= columns * 4) {
    for (let index = begin; index < end; ++index) keep(index);
    return trace;
  }
  const width = (to - from) / columns;
  for (let index = begin; index < end;) {
    const limit = from + (Math.floor((samples.at(index) - from) / width) + 1) * width;
    let last = index;
    let low = index;
    let high = index;
    let lowest = samples.sample(index)[quantity];
    let highest = lowest;
    while (last + 1 < end && samples.at(last + 1) < limit) {
      last += 1;
      const value = samples.sample(last)[quantity];
      if (value < lowest) { low = last; lowest = value; }
      if (value > highest) { high = last; highest = value; }
    }
    for (const kept of [...new Set([index, low, high, last])].sort((a, b) => a - b)) keep(kept);
    index = last + 1;
  }
  return trace;
}

/** Traces on one time axis: each time of any of them once, null where a trace has no sample there. */
export function align(traces: readonly Trace[]): [number[], ...(number | null)[][]] {
  const times = [...new Set(traces.flatMap(({ at }) => at))].sort((a, b) => a - b);
  const place = new Map(times.map((time, index) => [time, index]));
  const columns = traces.map(({ at, value }) => {
    const column = new Array<number | null | undefined>(times.length).fill(undefined);
    at.forEach((time, index) => { column[place.get(time)!] = value[index]!; });
    return column as (number | null)[];
  });
  return [times, ...columns];
}

/** The samples of an array as `thin` reads them. */
export function listed(samples: readonly Sample[]) {
  return {
    length: samples.length,
    at: (index: number) => samples[index]!.at,
    sample: (index: number) => samples[index]!,
    find(at: number) {
      const found = samples.findIndex((sample) => sample.at >= at);
      return found < 0 ? samples.length : found;
    },
  };
}
