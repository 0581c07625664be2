// What a chart shows. What draws it is fetched when it is needed.
import type { Trace } from '../model/series';

export interface Line {
  label: string;
  /** Axis on the left or right that its values are read from: lines of one unit share it. */
  scale: string;
  /** Index of its colour and dashes. */
  style: number;
  stepped?: boolean;
}

export interface Mark { at: number; text: string; style: 'dashed' | 'solid' }

export interface ChartSpec {
  lines: readonly Line[];
  height: number;
  /** Times of day; else seconds from a moment. */
  clock: boolean;
  /** Called with a time that was tapped. */
  pick?: (at: number) => void;
}

/** No curve is told by its colour alone. */
export const dashes: (number[] | undefined)[] = [undefined, [10, 5], [3, 4], [12, 4, 3, 4], [6, 6], [16, 6]];

/** Dashes of a line, for its entry in a legend. */
export const dashOf = (style: number): string => (dashes[style % 6] ?? []).join(' ');

/** Times of traces from milliseconds to seconds from `zero`. */
export function inSeconds(trace: Trace, zero: number): Trace {
  return { at: trace.at.map((at) => (at - zero) / 1000), value: trace.value };
}
