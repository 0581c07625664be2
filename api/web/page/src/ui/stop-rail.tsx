// The stops: on every screen, at one place. They never ask, and need no lease and no role.
import { report, stopAll, stopAxis } from '../stops';
import { route, lastAxis, machine } from '../route';
import { store } from '../app';
import { t } from '../i18n';
import { CommandState, type Command } from '@proto/types_pb';
import { spanText } from '../model/numbers';
import { endText, stateText } from './words';

/** STOP is for the axis that is shown, or was shown last. */
export function stopTarget(): string {
  const { screen, of } = route.value;
  const names = store.names.value;
  if (screen === 'axis' && names.includes(of)) return of;
  return names.includes(lastAxis.value) ? lastAxis.value : names[0] ?? '';
}

/** A press counts when the finger goes down: a stop waits for nothing. */
export const pressed = (run: () => void) => ({
  onPointerDown: (event: PointerEvent) => { if (event.button === 0) { event.preventDefault(); run(); } },
  onKeyDown: (event: KeyboardEvent) => {
    if ((event.key === 'Enter' || event.key === ' ') && !event.repeat) { event.preventDefault(); run(); }
  },
  // By a screen reader, which makes neither.
  onClick: (event: MouseEvent) => { if (event.detail === 0) run(); },
});

export function StopRail() {
  const axis = stopTarget();
  return (
    <div class="stops" role="region" aria-label={t('stop.region')}>
      <button class="stop all" data-stop="all" {...pressed(() => void stopAll())}>{t('stop.all')}{machine !== '' && <span class="of">{machine}</span>}</button>
      {axis !== '' && (
        <button class="stop" data-stop={axis} {...pressed(() => void stopAxis(axis))}>
          {t('stop.one')}<span class="of">{axis}</span>
        </button>
      )}
    </div>
  );
}

function outcomeText(axis: string, command: Command | null, error: unknown): string {
  if (error !== null) return typeof error === 'string' ? error : (error as { message: string }).message;
  const now = store.commands.value.find(({ id }) => id === command?.id) ?? command;
  const entry = store.axis(axis);
  const state = entry === undefined ? '' : stateText(entry.state.value, entry.age.value);
  if (now === null || now.state === CommandState.ACCEPTED || now.state === CommandState.ACTIVE) return [t('stop.sent'), state].filter(Boolean).join(' · ');
  return `${endText(now)} · ${state}${now.cause ? ` · ${now.cause.message}` : ''}`;
}

/** What became of the last stop, per axis. */
export function StopReportView() {
  const shown = report.value;
  if (shown === null) return null;
  const title = shown.what === 'stop-all' ? t('stop.all') : shown.what === 'halt' ? `${t('action.halt')} ${shown.of}` : `${t('stop.one')} ${shown.of}`;
  return (
    <section class={`report ${shown.failed !== null ? 'alarm' : ''}`} aria-live="assertive" aria-label={t('stop.report')}>
      <div class="line">
        <b>{title}</b>
        <span>{shown.failed !== null ? t('stop.failed', { why: shown.failed })
          : shown.answered === null ? t('stop.asking') : t('stop.answered', { time: spanText(shown.answered) })}</span>
        <button class="button quiet" onClick={() => { report.value = null; }}>{t('action.close')}</button>
      </div>
      {shown.outcomes.length > 0 && (
        <ul class="outcomes">
          {shown.outcomes.map(({ axis, command, error }) => (
            <li key={axis} class={error !== null ? 'alarm' : ''}><b>{axis}</b> {outcomeText(axis, command, error)}</li>
          ))}
        </ul>
      )}
    </section>
  );
}
