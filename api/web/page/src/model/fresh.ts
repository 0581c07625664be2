// Whether a value may be shown as live.

/** Refresh periods that are taken for one that is not known. */
const UNKNOWN_POLL_MS = 250;

const SEEN = 9;
const LONGEST_POLL_MS = 5000;

/** How often an axis is read, at rest and in motion: as it was seen, since what a bus promises is the worst case. */
export class PollMeter {
  private last: { at: number; moving: boolean } | null = null;
  private readonly seen: { [moving: string]: number[] } = { true: [], false: [] };

  /** A reading of the drive. */
  read(at: number, moving: boolean): void {
    if (this.last !== null && this.last.moving === moving && at > this.last.at) {
      const list = this.seen[String(moving)]!;
      list.push(at - this.last.at);
      if (list.length > SEEN) list.shift();
    }
    this.last = { at, moving };
  }

  /** The usual time between readings: a gap does not change it. Null: not known yet. */
  period(moving: boolean): number | null {
    const list = [...this.seen[String(moving)]!].sort((a, b) => a - b);
    return list.length < 3 ? null : Math.min(list[list.length >> 1]!, LONGEST_POLL_MS);
  }
}

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
