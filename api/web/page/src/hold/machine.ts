// Hold to run, as a pure state machine: what happened goes in, what is to be done comes out. The axis moves while a button
// is held by a person at a page that is being painted; whatever else happens ends it, and the button has to be let go
// before anything moves again.

/** From the last renewal that arrives, the drive goes on for so long. */
export const HOLD_MS = 300;
/** Time between renewals. */
export const RENEW_MS = 80;
/** A page that was not painted for so long renews nothing. */
export const PAINTED_MS = 100;
/** A press whose event is older than that was made while the page hung: nobody may be holding any more. */
export const PRESS_MS = 100;
/** Refused while the lane takes longer. */
export const LANE_MS = 300;

/** What is held: a finger or mouse button, or a key. */
export type Source = { by: 'pointer'; id: number } | { by: 'key'; code: string };

/** What ended a hold that its own release did not end. */
export type Loss =
  | 'pointer-cancel' | 'lost-capture' | 'blur' | 'hidden' | 'page-hide' | 'second-pointer' | 'context-menu'
  | 'not-painted' | 'lane-lost' | 'lane-slow' | 'late-press' | 'dropped' | 'refused' | 'control-lost' | 'not-live'
  | 'not-possible';

export type State =
  | { at: 'idle' }
  /** Jogging. `unanswered`: when the oldest request without an answer was sent; `started`: the first one was answered. */
  | { at: 'held'; source: Source; press: string; velocity: number; painted: number; renewed: number;
      unanswered: readonly number[]; started: boolean }
  /** It has ended, and the button is still down. */
  | { at: 'lost'; source: Source; loss: Loss };

export type Event =
  /** `made`: when the person did it; `alone`: no other finger is down. */
  | { type: 'press'; at: number; made: number; source: Source; alone: boolean; press: string; velocity: number;
      lane: number; blocked: Loss | null }
  | { type: 'frame'; at: number }
  | { type: 'release'; source: Source }
  | { type: 'loss'; loss: Loss }
  | { type: 'answer'; press: string; sent: number; outcome: 'ok' | 'dropped' | 'refused' };

export type Effect =
  | { do: 'jog'; press: string; velocity: number; sent: number }
  | { do: 'halt' }
  | { do: 'capture'; pointer: number }
  | { do: 'say'; loss: Loss };

export interface Step { state: State; effects: Effect[] }

export const idle: State = { at: 'idle' };

const same = (a: Source, b: Source): boolean =>
  a.by === 'pointer' ? b.by === 'pointer' && a.id === b.id : b.by === 'key' && a.code === b.code;

/** Releases go unheard meanwhile. */
const unheard = (loss: Loss): boolean => loss === 'blur' || loss === 'hidden' || loss === 'page-hide';

const stay = (state: State): Step => ({ state, effects: [] });

/** The hold is over although the button is down. */
function lose(source: Source, loss: Loss, halts: boolean): Step {
  const effects: Effect[] = halts ? [{ do: 'halt' }] : [];
  return { state: { at: 'lost', source, loss }, effects: [...effects, { do: 'say', loss }] };
}

/** Whether what was held when it was lost must have been let go since: of a touch that was cancelled, and of a key let go
 * while another window had the focus, no release is ever heard; but nothing goes down that is not up. */
function letGo(lost: State & { at: 'lost' }, event: Event & { type: 'press' }): boolean {
  if (event.source.by === 'pointer') return lost.source.by === 'key' ? unheard(lost.loss) : event.alone;
  return same(lost.source, event.source) || unheard(lost.loss);
}

function press(state: State, event: Event & { type: 'press' }): Step {
  if (state.at === 'held') return lose(state.source, 'second-pointer', true);
  if (state.at === 'lost' && !letGo(state, event)) return stay(state);
  const { source, at } = event;
  if (event.blocked !== null) return lose(source, event.blocked, false);
  if (at - event.made > PRESS_MS) return lose(source, 'late-press', false);
  if (!(event.lane <= LANE_MS)) return lose(source, 'lane-slow', false);
  const effects: Effect[] = source.by === 'pointer' ? [{ do: 'capture', pointer: source.id }] : [];
  effects.push({ do: 'jog', press: event.press, velocity: event.velocity, sent: at });
  return {
    state: { at: 'held', source, press: event.press, velocity: event.velocity, painted: at, renewed: at,
             unanswered: [at], started: false },
    effects,
  };
}

function frame(state: State, at: number): Step {
  if (state.at !== 'held') return stay(state);
  if (at - state.painted > PAINTED_MS) return lose(state.source, 'not-painted', true);
  const oldest = state.unanswered[0];
  if (oldest !== undefined && at - oldest > LANE_MS) return lose(state.source, 'lane-slow', true);
  if (at - state.renewed < RENEW_MS) return stay({ ...state, painted: at });
  return {
    state: { ...state, painted: at, renewed: at, unanswered: [...state.unanswered, at] },
    effects: [{ do: 'jog', press: state.press, velocity: state.velocity, sent: at }],
  };
}

function answer(state: State, event: Event & { type: 'answer' }): Step {
  if (state.at !== 'held' || event.press !== state.press) return stay(state);
  // A press that was never executed has nothing to halt; what somebody else began meanwhile goes on.
  if (event.outcome !== 'ok') return lose(state.source, event.outcome, state.started);
  return stay({ ...state, started: true, unanswered: state.unanswered.filter((sent) => sent !== event.sent) });
}

export function step(state: State, event: Event): Step {
  switch (event.type) {
    case 'press': return press(state, event);
    case 'frame': return frame(state, event.at);
    case 'answer': return answer(state, event);
    case 'release':
      if (state.at === 'idle' || !same(state.source, event.source)) return stay(state);
      return { state: idle, effects: state.at === 'held' ? [{ do: 'halt' }] : [] };
    case 'loss':
      if (state.at === 'held') return lose(state.source, event.loss, true);
      return stay(state);
  }
}
