// What an axis may do, read from what stands in the way of a command far outside of it.
import { Reason, type ErrorDetail } from '@proto/error_pb';

export interface Ranges { position: [number, number] | null; velocity: [number, number] | null }

export function rangesOf(details: readonly ErrorDetail[], unit: string): Ranges {
  const ranges: Ranges = { position: null, velocity: null };
  for (const { reason, permitted } of details) {
    if (permitted === undefined) continue;
    if (permitted.unit === `${unit}/s`) ranges.velocity = [permitted.minimum, permitted.maximum];
    else if (reason === Reason.SOFT_LIMIT && permitted.unit === unit) ranges.position = [permitted.minimum, permitted.maximum];
  }
  return ranges;
}

/** The largest of 1, 2, 5, 10, 20 ... that is not above. */
export function niceSpeed(most: number): number {
  if (!(most > 0)) return 0;
  const power = 10 ** Math.floor(Math.log10(most) + 1e-9);
  const digit = most / power;
  return (digit >= 5 ? 5 : digit >= 2 ? 2 : 1) * power;
}
