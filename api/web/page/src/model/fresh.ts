// Whether a value may be shown as live.

/** Refresh periods that are taken for one that is not known. */
const UNKNOWN_POLL_MS = 250;

/** Older than three polls is old: by then a reading is missing, and not just late. */
export function staleAfter(streamMs: number, pollMs: number | null): number {
  return 3 * Math.max(streamMs, pollMs ?? UNKNOWN_POLL_MS);
}

/** How old a value is: as old as it was when it came, and the time since then. */
export function ageNow(ageMs: number, received: number, now: number): number {
  return ageMs + Math.max(0, now - received);
}

/** The daemon's clock, as far as this page knows it: milliseconds since 1970 at a time of performance.now(). */
export class ServerClock {
  private offset: number | null = null;
  private seen = 0;

  /** A message that was made at `made` by the daemon's clock arrived at `now`. The quickest message tells best. */
  heard(made: number, now: number): void {
    const offset = made - now;
    // After a minute without a quicker one the clocks may have drifted, or been set.
    if (this.offset === null || offset > this.offset || now - this.seen > 60_000 || Math.abs(offset - this.offset) > 5000) {
      this.offset = offset;
      this.seen = now;
    }
  }

  /** Never later than the daemon's own; null: nothing was heard yet. */
  at(now: number): number | null { return this.offset === null ? null : now + this.offset; }

  forget(): void { this.offset = null; }
}
