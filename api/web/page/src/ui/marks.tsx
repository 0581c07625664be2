// Shapes beside words: no state is told by a colour alone.
import { LinkState, State, type AxisState } from '@proto/types_pb';

type Shape = 'ring' | 'disc' | 'diamond' | 'arrow' | 'square' | 'cross' | 'dashes' | 'bars';

const shapes: { [state: number]: Shape } = {
  [State.DISABLED]: 'ring', [State.STANDSTILL]: 'disc', [State.HOMING]: 'diamond', [State.DISCRETE_MOTION]: 'arrow',
  [State.CONTINUOUS_MOTION]: 'arrow', [State.SYNCHRONIZED_MOTION]: 'bars', [State.STOPPING]: 'square', [State.ERROR_STOP]: 'cross',
};

const paths: { [shape in Shape]: preact.JSX.Element } = {
  ring: <circle cx="8" cy="8" r="5" fill="none" stroke="currentColor" stroke-width="2" />,
  disc: <circle cx="8" cy="8" r="6" fill="currentColor" />,
  diamond: <path d="M8 1 15 8 8 15 1 8Z" fill="none" stroke="currentColor" stroke-width="2" />,
  arrow: <path d="M3 2 14 8 3 14Z" fill="currentColor" />,
  square: <rect x="2.5" y="2.5" width="11" height="11" fill="currentColor" />,
  cross: <path d="M3 3 13 13M13 3 3 13" stroke="currentColor" stroke-width="3" stroke-linecap="round" />,
  dashes: <circle cx="8" cy="8" r="5.5" fill="none" stroke="currentColor" stroke-width="2" stroke-dasharray="3 3" />,
  bars: <path d="M2 3h4v10H2zM10 3h4v10h-4z" fill="currentColor" />,
};

export function Mark({ shape }: { shape: Shape }) {
  return <svg class="mark" viewBox="0 0 16 16" aria-hidden="true">{paths[shape]}</svg>;
}

/** Which of the tones a state has: nothing to do, it moves, look here. */
export function tone(state: AxisState): 'rest' | 'moving' | 'alarm' | 'off' {
  if (state.link === LinkState.OFFLINE) return 'off';
  if (state.state === State.ERROR_STOP) return 'alarm';
  if (state.moving || [State.HOMING, State.DISCRETE_MOTION, State.CONTINUOUS_MOTION, State.SYNCHRONIZED_MOTION, State.STOPPING]
    .includes(state.state)) return 'moving';
  return 'rest';
}

export function StateMark({ state }: { state: AxisState }) {
  return <Mark shape={state.link === LinkState.OFFLINE ? 'dashes' : shapes[state.state] ?? 'ring'} />;
}
