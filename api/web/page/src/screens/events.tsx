// What was commanded and what happened, newest first.
import { useSignal } from '@preact/signals';
import { CommandState, type Command } from '@proto/types_pb';
import type { Event } from '@proto/event_service_pb';
import { happenings, store } from '../app';
import { clockFormat, t } from '../i18n';
import { reasonKey } from '../i18n/names';
import { eventText } from '../model/event-text';
import { instant } from '../model/wire';
import { commandText, endText } from '../ui/words';

const tones: { [state: number]: string } = {
  [CommandState.DONE]: 'done', [CommandState.ABORTED]: 'warning', [CommandState.ERROR]: 'error', [CommandState.UNKNOWN]: 'error' };

const clock = (at: number | null) => (at === null ? '-' : clockFormat.value.format(new Date(at)));

function CommandLine({ command, withAxis }: { command: Command; withAxis: boolean }) {
  const unit = store.axis(command.axis)?.state.peek().unit ?? '';
  const reason = command.cause === undefined ? null : reasonKey(command.cause.reason);
  return (
    <li class={tones[command.state] ?? 'busy'}>
      <time>{clock(instant(command.acceptedAt))}</time>
      <span class="text">{withAxis && <b>{command.axis} </b>}{commandText(command, unit)}
        <span class="ending"> {endText(command)}</span>
        {command.cause !== undefined && <span class="detail">{reason !== null && <b>{t(reason)}. </b>}{command.cause.message}</span>}</span>
      <span class="who">{command.client}</span>
    </li>
  );
}

export function CommandList({ axis, most }: { axis: string; most: number }) {
  const shown = store.commands.value.filter((command) => axis === '' || command.axis === axis).slice(0, most);
  if (shown.length === 0) return <p class="empty">{t('events.no-commands')}</p>;
  return <ul class="log">{shown.map((command) => <CommandLine key={command.id} command={command} withAxis={axis === ''} />)}</ul>;
}

export function EventList({ axis, most }: { axis: string; most: number }) {
  const shown = store.events.value.filter((event: Event) =>
    event.content.case !== 'commandChange' && (axis === '' || event.axis === axis || event.axis === '')).slice(0, most);
  if (shown.length === 0) return <p class="empty">{t('events.none')}</p>;
  return (
    <ul class="log">{shown.map((event) => (
      <li key={String(event.sequence)} class={event.content.case === 'axisFault' ? 'error' : ''}>
        <time>{clock(instant(event.at))}</time>
        <span class="text">{axis === '' && event.axis !== '' && <b>{event.axis} </b>}{eventText(event)}</span>
      </li>
    ))}</ul>
  );
}

export function EventsScreen() {
  const axis = useSignal('');
  const more = useSignal(60);
  return (
    <>
      <div class="row">
        <label class="field"><span class="caption">{t('column.axis')}</span>
          <span class="box"><select value={axis.value} onChange={(event) => { axis.value = event.currentTarget.value; }}>
            <option value="">{t('events.all-axes')}</option>
            {store.names.value.map((name) => <option key={name} value={name}>{name}</option>)}
          </select></span></label>
        {happenings.state.value !== 'live' && <span class="hint">{t('live.connecting')}</span>}
      </div>
      <div class="pair">
        <section class="card"><h2>{t('nav.commands')}</h2><CommandList axis={axis.value} most={more.value} /></section>
        <section class="card"><h2>{t('nav.events')}</h2><EventList axis={axis.value} most={more.value} /></section>
      </div>
      <button class="button" onClick={() => { more.value += 200; }}>{t('events.more')}</button>
    </>
  );
}
