// Control of axes by this page, as a pure state machine: leases of 2 s that are renewed while somebody looks at the page,
// and that end by hiding it, by 5 minutes without a touch, or by another's Take.

export const TTL_MS = 2000;
export const RENEW_MS = 600;
export const IDLE_MS = 5 * 60 * 1000;

export type Ending = 'hidden' | 'untouched' | 'expired' | 'taken' | 'released' | 'signed-out';

export interface Held { token: bigint; axes: readonly string[]; asked: number; confirmed: number }
export interface State { leases: readonly Held[]; touched: number }

export type Event =
  | { type: 'acquired'; token: bigint; axes: readonly string[]; at: number }
  | { type: 'frame'; at: number }
  | { type: 'renewed'; token: bigint; sent: number }
  /** The daemon says that it is over. */
  | { type: 'lost'; token: bigint }
  | { type: 'touched'; at: number }
  /** Of all axes, or of some: a lease ends as a whole. */
  | { type: 'end'; why: Ending; axes?: readonly string[] };

export type Effect =
  | { do: 'renew'; token: bigint; sent: number }
  | { do: 'release'; token: bigint }
  | { do: 'ended'; axes: readonly string[]; why: Ending };

export interface Step { state: State; effects: Effect[] }

export const none: State = { leases: [], touched: 0 };

function end(state: State, ending: (held: Held) => boolean, why: Ending, release: boolean): Step {
  const over = state.leases.filter(ending);
  const effects: Effect[] = [];
  for (const { token, axes } of over) {
    if (release) effects.push({ do: 'release', token });
    effects.push({ do: 'ended', axes, why });
  }
  return { state: over.length === 0 ? state : { ...state, leases: state.leases.filter((held) => !ending(held)) }, effects };
}

function frame(state: State, at: number): Step {
  if (state.leases.length === 0) return { state, effects: [] };
  if (at - state.touched > IDLE_MS) return end(state, () => true, 'untouched', true);
  const expired = end(state, (held) => at - held.confirmed > TTL_MS, 'expired', false);
  const effects = [...expired.effects];
  const leases = expired.state.leases.map((held) => {
    if (at - held.asked < RENEW_MS) return held;
    effects.push({ do: 'renew', token: held.token, sent: at });
    return { ...held, asked: at };
  });
  return { state: { ...expired.state, leases }, effects };
}

export function step(state: State, event: Event): Step {
  switch (event.type) {
    case 'acquired':
      return {
        state: {
          touched: Math.max(state.touched, event.at),
          // What is leased anew is no longer part of an older lease.
          leases: [...state.leases.filter(({ axes }) => !axes.some((axis) => event.axes.includes(axis))),
                   { token: event.token, axes: event.axes, asked: event.at, confirmed: event.at }],
        },
        effects: [],
      };
    case 'frame': return frame(state, event.at);
    case 'renewed':
      return {
        state: { ...state, leases: state.leases.map((held) =>
          held.token === event.token ? { ...held, confirmed: Math.max(held.confirmed, event.sent) } : held) },
        effects: [],
      };
    case 'lost': return end(state, ({ token }) => token === event.token, 'taken', false);
    case 'touched': return { state: { ...state, touched: event.at }, effects: [] };
    case 'end': {
      const { axes } = event;
      return end(state, (held) => axes === undefined || held.axes.some((axis) => axes.includes(axis)), event.why, true);
    }
  }
}

/** Fencing token for commands of an axis; 0: it is not under this page's control. */
export function tokenOf(state: State, axis: string): bigint {
  return state.leases.find(({ axes }) => axes.includes(axis))?.token ?? 0n;
}
