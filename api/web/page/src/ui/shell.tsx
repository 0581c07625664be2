// What is around every screen: head, navigation, stops, and what was said last.
import { Role } from '@proto/access_pb';
import { lane, laneTakes, states, store, leases, endControl, lostBy, refused } from '../app';
import { LANE_MS } from '../hold/machine';
import { clockFormat, t } from '../i18n';
import { roleKey } from '../i18n/names';
import { axesText } from './words';
import { places, route, go, hrefOf, lastAxis, machine } from '../route';
import { session } from '../transport/session';
import { Dialog } from './dialog';
import { dismiss, notices, type Text } from './notices';
import { askReleaseAll } from './questions';
import { StopRail, StopReportView } from './stop-rail';
import { Screen } from '../screens';
import { icons } from './icons';
import type { ComponentChildren } from 'preact';

function Fact({ children, label, warn }: { children: ComponentChildren; label?: string; warn?: boolean }) {
  return <span class={`fact ${warn ? 'warn' : ''}`}>{label !== undefined && <span class="caption">{label}</span>}{children}</span>;
}

function LaneFact() {
  const takes = laneTakes.value;
  const slow = !(takes <= LANE_MS);
  const text = lane.state.value !== 'open' ? t('lane.closed') : takes === 0 ? '…' : `${Math.max(1, Math.round(takes))} ms`;
  return <Fact label={t('lane.name')} warn={slow}>{text}</Fact>;
}

function Head() {
  const info = store.info.value;
  const who = session.value.at === 'in' ? session.value : null;
  const role = info === null ? null : roleKey(info.role);
  return (
    <header>
      {machine !== '' && <a href="/">{t('cell.all')}</a>}
      <a class="machine" href={hrefOf('machine')} onClick={(event) => { event.preventDefault(); go('machine'); }}>{info?.machine ?? 'axisd'}</a>
      <Fact>{axesText(store.names.value.length)}</Fact>
      {store.statistics.value.map(({ bus, utilisation }) => <Fact key={bus} label={bus}>{Math.round(utilisation * 100)} %</Fact>)}
      <LaneFact />
      {/* Where the page is refused, what the daemon tells is of axisd-web itself. */}
      {who !== null && <Fact>{refused.value ? who.name : <>{info?.client || who.name}{role !== null && info?.role !== Role.UNSPECIFIED && ` (${t(role)})`}</>}</Fact>}
    </header>
  );
}

function Nav() {
  const { screen } = route.value;
  return (
    <nav aria-label={t('nav.label')}>
      {places.filter(({ ready }) => ready).map(({ id, title }) => {
        const of = id === 'axis' ? lastAxis.value || store.names.value[0] || '' : '';
        return (
          <a key={id} href={hrefOf(id)} aria-current={screen === id ? 'page' : undefined}
             onClick={(event) => { event.preventDefault(); go(id, of); }}>
            {icons[id]}<span>{t(title)}</span>
          </a>
        );
      })}
    </nav>
  );
}

/** What everybody at this page has to know now. */
function Banners() {
  const info = store.info.value;
  const inhibited = store.inhibited.value;
  const live = store.live.value;
  // The screen of the axis itself shows it.
  const { screen, of } = route.value;
  const held = leases.value.flatMap(({ axes }) => axes);
  const elsewhere = held.length > 0 && !(screen === 'axis' && held.length === 1 && held[0] === of);
  return (
    <>
      {!live && (
        <div class="banner alarm" role="alert">
          {refused.value
            ? <b>{t('live.refused')}</b>
            : <><b>{t('live.none')}</b> <span>{states.state.value === 'connecting' ? t('live.connecting') : t('live.lost')}</span></>}
          {lostBy.value !== undefined && <span class="detail">{lostBy.value.message}{lostBy.value.remedy !== '' && `; ${lostBy.value.remedy}`}</span>}
          <button class="button" onClick={() => states.retry()}>{t('action.reconnect')}</button>
        </div>
      )}
      {inhibited && (
        <div class="banner warning" role="status">
          <b>{t('stop.all')}</b> <span>{info?.inhibitedBy ? t('inhibit.by', { who: info.inhibitedBy }) : t('inhibit.text')}</span>
          <button class="button" onClick={askReleaseAll}>{t('action.release-all')}…</button>
        </div>
      )}
      {elsewhere && (
        <div class="banner control" role="status">
          <b>{t('control.mine')}</b> <span>{held.join(', ')}</span>
          <button class="button" onClick={() => endControl('released')}>{t('action.give-back')}</button>
        </div>
      )}
    </>
  );
}

const said = (text: Text): string => ('plain' in text ? text.plain : t(text.key, text.values));

function Notices() {
  return (
    <ul class="notices" aria-live="polite" aria-label={t('notices.label')}>
      {notices.value.map(({ id, level, at, text, more }) => (
        <li key={id} class={level}>
          <time>{clockFormat.value.format(at)}</time>
          <span><b>{said(text)}</b>{more && <> {more}</>}</span>
          <button class="button quiet" aria-label={t('action.close')} onClick={() => dismiss(id)}>×</button>
        </li>
      ))}
    </ul>
  );
}

export function Shell() {
  return (
    <div class="shell">
      <Head />
      <Nav />
      <StopRail />
      <div class="middle">
        <Banners />
        <StopReportView />
        <main tabIndex={0}>
          {route.value.screen !== 'axis' && <h1 class="unseen">{t(`nav.${route.value.screen}` as 'nav.machine')}</h1>}
          <Screen />
        </main>
        <Notices />
        <Dialog />
      </div>
    </div>
  );
}
