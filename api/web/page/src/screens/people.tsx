// Who is here, who may do what, who has which axes; and how this browser shows the page.
import { useSignal } from '@preact/signals';
import { useEffect } from 'preact/hooks';
import type { Lease } from '@proto/lease_service_pb';
import { store, tokenFor, visible } from '../app';
import { clockFormat, t } from '../i18n';
import { roleKey } from '../i18n/names';
import { spanText } from '../model/numbers';
import { eventText } from '../model/event-text';
import { instant, milliseconds } from '../model/wire';
import { CALL_MS, clients } from '../transport/clients';
import { session, signOut } from '../transport/session';
import { LanguageChoice, PanelChoice, ThemeChoice } from '../ui/choices';
import { askRelease, askTakeControl } from '../ui/questions';

const EVERY = 1000;

function Leases() {
  const leases = useSignal<readonly Lease[] | null>(null);
  useEffect(() => {
    let timer: ReturnType<typeof setTimeout> | undefined;
    let over = false;
    const refresh = async () => {
      if (visible.peek() && store.live.peek()) {
        try { leases.value = (await clients.leases.listLeases({}, { timeoutMs: CALL_MS })).leases; } catch { leases.value = null; }
      }
      if (!over) timer = setTimeout(() => void refresh(), EVERY);
    };
    void refresh();
    return () => { over = true; clearTimeout(timer); };
  }, []);
  if (leases.value === null) return <p class="empty">{t('live.connecting')}</p>;
  if (leases.value.length === 0) return <p class="empty">{t('people.no-leases')}</p>;
  return (
    <table>
      <thead><tr><th scope="col">{t('people.who')}</th><th scope="col">{t('column.axis')}</th><th scope="col" class="number">{t('people.remaining')}</th><th /></tr></thead>
      <tbody>{leases.value.map((lease) => (
        <tr key={`${lease.client}${lease.axes.join()}`}>
          <th scope="row">{lease.client} <span class="function">{lease.label}</span></th>
          <td>{lease.axes.join(', ')}</td><td class="number">{spanText(milliseconds(lease.remaining) ?? 0)}</td>
          <td>{!lease.axes.every((axis) => tokenFor(axis) !== 0n) &&
            <button class="button" onClick={() => void askTakeControl(lease.axes)}>{t('action.take-control')}…</button>}</td>
        </tr>
      ))}</tbody>
    </table>
  );
}

function Holds() {
  const held = store.names.value.flatMap((name) => {
    const state = store.axis(name)?.state.value;
    return (state?.holds ?? []).map((hold) => ({ name, hold }));
  });
  if (held.length === 0) return <p class="empty">{t('people.no-holds')}</p>;
  return (
    <ul class="log">{held.map(({ name, hold }) => (
      <li key={`${name}${hold.holder}${hold.requestId}`}>
        <time>{clockFormat.value.format(new Date(instant(hold.since) ?? 0))}</time>
        <span class="text"><b>{name}</b> {t('note.held', { who: hold.holder })}</span>
        <button class="button" onClick={() => askRelease(name)}>{t('action.release-hold')}…</button>
      </li>
    ))}</ul>
  );
}

export function PeopleScreen() {
  const info = store.info.value;
  const who = session.value;
  const role = info === null ? null : roleKey(info.role);
  const changes = store.events.value.filter(({ content }) => content.case === 'leaseChange').slice(0, 12);
  return (
    <div class="pair">
      <section class="card">
        <h2>{t('people.you')}</h2>
        <dl class="figures wide">
          <div><dt>{t('people.name')}</dt><dd>{info?.client ?? (who.at === 'in' ? who.name : '-')}</dd></div>
          <div><dt>{t('people.role')}</dt><dd>{role === null ? '-' : t(role)}</dd></div>
          {who.at === 'in' && <div><dt>{t('people.how')}</dt><dd>{t(`how.${who.how}`)}</dd></div>}
        </dl>
        {info !== null && info.axisRoles.length > 0 && (
          <ul class="notes">{info.axisRoles.map(({ axis, role: own }) => { const key = roleKey(own); return <li key={axis}>{axis}: {key === null ? '-' : t(key)}</li>; })}</ul>
        )}
        {who.at === 'in' && who.how === 'password' && <button class="button" onClick={() => void signOut()}>{t('action.sign-out')}</button>}
        <h2>{t('settings.title')}</h2>
        <div class="settings">
          <span class="caption">{t('settings.language')}</span><LanguageChoice />
          <span class="caption">{t('settings.theme')}</span><ThemeChoice />
          <span class="caption">{t('settings.size')}</span><PanelChoice />
        </div>
      </section>
      <div>
        <section class="card"><h2>{t('people.leases')}</h2><Leases /></section>
        <section class="card"><h2>{t('people.holds')}</h2><Holds /></section>
        <section class="card"><h2>{t('people.changes')}</h2>
          {changes.length === 0 ? <p class="empty">{t('events.none')}</p> : (
            <ul class="log">{changes.map((event) => (
              <li key={String(event.sequence)}><time>{clockFormat.value.format(new Date(instant(event.at) ?? 0))}</time>
                <span class="text"><b>{event.axis}</b> {eventText(event)}</span></li>))}</ul>
          )}
        </section>
      </div>
    </div>
  );
}
