// Buttons that move the axis while they are held.
import type { Signal } from '@preact/signals';
import { useEffect, useMemo, useRef } from 'preact/hooks';
import { laneTakes } from '../app';
import { Holder } from '../hold/driver';
import { LANE_MS, type Loss } from '../hold/machine';
import { t } from '../i18n';
import { shown } from '../model/numbers';
import type { Act } from './explained';
import { NumberField } from './field';

/** The dead-man key: an arrow key moves nothing unless this is held beside it. */
const DEAD_MAN = 'Shift';

interface Props {
  axis: string;
  speeds: { slow: number; fast: number } | null;
  unit: string;
  plus: Act;
  minus: Act;
  typedSpeed: Signal<string>;
}

export function JogPad({ axis, speeds, unit, plus, minus, typedSpeed }: Props) {
  const pad = useRef<HTMLDivElement>(null);
  const holder = useMemo(() => new Holder(axis, (pointer) => {
    const button = pad.current?.querySelector(`[data-pointer="${pointer}"]`);
    try { button?.setPointerCapture(pointer); } catch { holder.dispatch({ type: 'loss', loss: 'lost-capture' }); }
  }), [axis]);
  useEffect(() => () => holder.close(), [holder]);
  const blockedOf = (act: Act): Loss | null => (speeds === null || act.obstacle !== null ? 'not-possible' : null);
  const latest = useRef({ speeds, plus, minus });
  latest.current = { speeds, plus, minus };

  useEffect(() => {
    const element = pad.current!;
    // A long touch is a hold, and no question for a menu.
    const touched = (event: TouchEvent) => { if ((event.target as Element).closest('[data-jog]')) event.preventDefault(); };
    element.addEventListener('touchstart', touched, { passive: false });
    // Any other finger, anywhere on the page, ends the hold.
    const second = (event: PointerEvent) => {
      const { value } = holder.state;
      if (value.at === 'held' && !(value.source.by === 'pointer' && value.source.id === event.pointerId)) {
        holder.dispatch({ type: 'loss', loss: 'second-pointer' });
      }
    };
    const menu = () => holder.dispatch({ type: 'loss', loss: 'context-menu' });
    addEventListener('pointerdown', second, { capture: true });
    addEventListener('contextmenu', menu, { capture: true });
    const up = (event: KeyboardEvent) => {
      if (event.key === DEAD_MAN) {
        const { value } = holder.state;
        if (value.at !== 'idle' && value.source.by === 'key') holder.dispatch({ type: 'release', source: value.source });
      } else holder.dispatch({ type: 'release', source: { by: 'key', code: event.code } });
    };
    addEventListener('keyup', up, { capture: true });
    return () => {
      element.removeEventListener('touchstart', touched);
      removeEventListener('pointerdown', second, { capture: true });
      removeEventListener('contextmenu', menu, { capture: true });
      removeEventListener('keyup', up, { capture: true });
    };
  }, [holder]);

  const keyDown = (event: KeyboardEvent) => {
    // In a field the same keys move the cursor.
    if ((event.key !== 'ArrowLeft' && event.key !== 'ArrowRight') || (event.target as Element).closest('input')) return;
    event.preventDefault();
    const { speeds: now, plus: up, minus: down } = latest.current;
    if (event.repeat || !event.getModifierState(DEAD_MAN)) return;
    const right = event.key === 'ArrowRight';
    holder.press({ by: 'key', code: event.code }, true, (right ? 1 : -1) * (now?.slow ?? 0), event.timeStamp,
                 now === null || (right ? up : down).obstacle !== null ? 'not-possible' : null);
  };

  const button = (id: string, act: Act, velocity: number, label: string, arrow: string) => {
    const held = holder.state.value.at === 'held' && holder.state.value.velocity === velocity && velocity !== 0;
    return (
      <button class={`button jog ${held ? 'held' : ''}`} data-jog={id} aria-disabled={blockedOf(act) !== null} aria-pressed={held}
              aria-label={`${label} ${shown(Math.abs(velocity), 1)} ${unit}/s`}
              onPointerDown={(event) => {
                if (event.button !== 0) return;
                event.preventDefault();
                event.currentTarget.focus();
                event.currentTarget.dataset['pointer'] = String(event.pointerId);
                holder.press({ by: 'pointer', id: event.pointerId }, event.isPrimary, velocity, event.timeStamp, blockedOf(act));
              }}
              onPointerUp={(event) => holder.dispatch({ type: 'release', source: { by: 'pointer', id: event.pointerId } })}
              onPointerCancel={() => holder.dispatch({ type: 'loss', loss: 'pointer-cancel' })}
              onLostPointerCapture={() => holder.dispatch({ type: 'loss', loss: 'lost-capture' })}
              onContextMenu={(event) => event.preventDefault()}>
        <span class="arrow" aria-hidden="true">{arrow}</span>
        <small>{velocity === 0 ? '-' : `${shown(Math.abs(velocity), Math.abs(velocity) < 10 ? 1 : 0)} ${unit}/s`}</small>
      </button>
    );
  };
  const fast = speeds?.fast ?? 0;
  const slow = speeds?.slow ?? 0;
  const said = holder.said.value;
  const takes = laneTakes.value;
  const state = holder.state.value;
  return (
    <div class="jog-pad" role="group" aria-label={t('jog.label')} ref={pad} tabIndex={0} onKeyDown={keyDown} data-hold={state.at}>
      <div class="jog-buttons">
        {button('--', minus, -fast, t('jog.minus-fast'), '«')}
        {button('-', minus, -slow, t('jog.minus'), '‹')}
        <span class="hold">{state.at === 'held' ? t('jog.moving') : t('jog.hold')}</span>
        {button('+', plus, slow, t('jog.plus'), '›')}
        {button('++', plus, fast, t('jog.plus-fast'), '»')}
      </div>
      <NumberField value={typedSpeed} label={t('jog.speed')} unit={`${unit}/s`} width={5} />
      <p class="jog-said" aria-live="assertive">
        {said !== null && <><b>{t(`loss.${said.loss}`)}</b> {said.text} {state.at === 'lost' && t('jog.let-go')}</>}
        {said === null && !(takes <= LANE_MS) && t('jog.lane-slow')}
        {said === null && takes <= LANE_MS && <span class="hint">{t('jog.keys')}</span>}
      </p>
    </div>
  );
}
