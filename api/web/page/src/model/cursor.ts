import type { Quantity, Sample } from './series';

/** What a curve shows at a time: of the last sample until then. Null: there is none. */
export function valueAt(samples: { length: number; at(index: number): number; sample(index: number): Sample; find(at: number): number },
                        quantity: Quantity, at: number): number | null {
  let index = samples.find(at);
  if (index >= samples.length || samples.at(index) > at) index -= 1;
  if (index < 0) return null;
  const value = samples.sample(index)[quantity];
  return Number.isNaN(value) ? null : value;
}
