// LatencyHistogram of the contract: counts[i] is how often something took at most 0.1 ms * 2^(i/4).

const bound = (index: number): number => 0.1 * 2 ** (index / 4);

export function histogramCount(counts: readonly bigint[]): bigint {
  return counts.reduce((sum, count) => sum + count, 0n);
}

/** Milliseconds that a share of all stayed within; null: there are none. */
export function quantile(counts: readonly bigint[], share: number): number | null {
  const all = Number(histogramCount(counts));
  if (all === 0) return null;
  let seen = 0;
  for (let index = 0; index < counts.length; ++index) {
    seen += Number(counts[index]);
    if (seen >= all * share) return bound(index);
  }
  return bound(counts.length - 1);
}
