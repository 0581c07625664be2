// What each bus promises, and what was seen of it.
import { useEffect } from 'preact/hooks';
import { BusKind, type Bus, type BusStatistics, type NodeStatistics } from '@proto/bus_service_pb';
import type { BusBudget } from '@proto/budget_pb';
import { store, traffic, watchesBuses } from '../app';
import { t } from '../i18n';
import { classKey, networkKey } from '../i18n/names';
import { ageText, shown, spanText } from '../model/numbers';
import { quantile, histogramCount } from '../model/histogram';
import { milliseconds } from '../model/wire';

const span = (value: number | null | undefined): string => (value === null || value === undefined ? '-' : spanText(value));
const share = (value: number | undefined): string => (value === undefined ? '-' : `${Math.round(value * 100)} %`);

/** Seen beside promised, with a bar; what was seen beyond what was promised is named. */
function Beside({ label, seen, bound }: { label: string; seen: number | null | undefined; bound: number | null | undefined }) {
  const known = seen !== null && seen !== undefined && bound !== null && bound !== undefined && bound > 0;
  const part = known ? Math.min(1, seen / bound) : 0;
  const beyond = known && seen > bound;
  return (
    <div class={`beside ${beyond ? 'alarm' : ''}`}>
      <span class="caption">{label}</span>
      <span><b>{span(seen)}</b> {t('bus.at-most', { bound: span(bound) })}{beyond && <> · {t('bus.beyond')}</>}</span>
      <svg class="bar" viewBox="0 0 100 6" preserveAspectRatio="none" aria-hidden="true">
        <rect class="all" width="100" height="6" /><rect class="part" width={Math.max(part * 100, known ? 1 : 0)} height="6" />
      </svg>
    </div>
  );
}

function LoadBar({ statistics, budget }: { statistics: BusStatistics | undefined; budget: BusBudget | undefined }) {
  const bound = budget?.load[budget.load.length - 1]?.utilisation;
  const now = statistics?.utilisation ?? 0;
  return (
    <div class="beside load">
      <span class="caption">{t('bus.load')}</span>
      <span><b>{share(statistics?.utilisation)}</b> {t('bus.of', { bound: share(bound) })}</span>
      <svg class="bar" viewBox="0 0 100 6" preserveAspectRatio="none" aria-hidden="true">
        <rect class="all" width="100" height="6" /><rect class="part" width={Math.min(100, now * 100)} height="6" />
        {bound !== undefined && <rect class="bound" x={Math.min(99, bound * 100)} width="0.3" height="6" />}
      </svg>
    </div>
  );
}

function Node({ node }: { node: NodeStatistics }) {
  const line = node.line;
  const network = node.network;
  const quarantine = line?.quarantine?.active ? line.quarantine : undefined;
  return (
    <tr class={quarantine ? 'alarm' : ''}>
      <th scope="row">{node.node} <span class="function">{node.name}</span></th>
      <td class="number">{String(line?.replies ?? network?.sdoTransfers ?? 0n)}</td>
      <td class="number">{String(line?.timeouts ?? network?.sdoTimeouts ?? 0n)}</td>
      <td class="number">{String(line === undefined ? network?.sdoProtocolErrors ?? 0n : line.corruptReplies)}</td>
      <td class="number">{String(line === undefined ? network?.sdoAborts ?? 0n : line.exceptions.reduce((sum, { count }) => sum + count, 0n))}</td>
      <td class="number">{span(milliseconds(line?.longestTurnaround))}</td>
      <td>{quarantine ? t('bus.quarantine', { time: ageText(milliseconds(quarantine.lasting) ?? 0), next: span(milliseconds(quarantine.nextProbeIn)) })
        : t('bus.answers')}</td>
    </tr>
  );
}

function BusCard({ bus, statistics, budget }: { bus: Bus; statistics: BusStatistics | undefined; budget: BusBudget | undefined }) {
  const network = bus.network === undefined ? null : networkKey(bus.network.link);
  const error = bus.error ?? bus.network?.linkHelperError;
  const all = budget?.stops[budget.stops.length - 1];
  return (
    <section class="card bus" aria-label={bus.name}>
      <h2>{bus.name} <small>{bus.kind === BusKind.CANOPEN ? 'CANopen' : 'Modbus RTU'} · {bus.port} · {bus.baud} bit/s
        {network !== null && ` · ${t(network)}`}{!bus.open && ` · ${t('bus.closed')}`}</small></h2>
      {error !== undefined && <p class="alarm-text">{error.message}{error.remedy && `: ${error.remedy}`}</p>}
      <LoadBar statistics={statistics} budget={budget} />
      <div class="budget">
        {budget?.axes.map((axis) => (
          <section key={axis.axis} aria-label={axis.axis}>
            <h3>{axis.axis}</h3>
            <Beside label={t('bus.refresh-idle')} seen={milliseconds(axis.observed?.refreshIdle)} bound={milliseconds(axis.refreshIdle)} />
            <Beside label={t('bus.refresh-moving')} seen={milliseconds(axis.observed?.refreshMoving)} bound={milliseconds(axis.refreshMovingAll)} />
            <Beside label={t('bus.stop')} seen={milliseconds(axis.observed?.stopFrame)} bound={milliseconds(axis.stopAlone?.lastFrame)} />
            <Beside label={t('bus.stop-all')} seen={milliseconds(axis.observed?.stopFrameAll)} bound={milliseconds(all?.lastFrame)} />
            <span class="hint">{t('bus.way', { way: Number.isFinite(axis.wayAlone) ? `${shown(axis.wayAlone, 1)} ${axis.unit}` : t('bus.no-bound') })}</span>
          </section>
        ))}
      </div>
      {budget !== undefined && budget.excess.length > 0 && (
        <ul class="reasons">{budget.excess.map(({ message, remedy }) => <li key={message}><span class="text"><b>{message}.</b> {remedy}</span></li>)}</ul>
      )}
      {budget !== undefined && budget.notes.length > 0 && <ul class="notes">{budget.notes.map((note) => <li key={note}>{note}</li>)}</ul>}
      {statistics !== undefined && (
        <div class="tables">
          <table>
            <caption>{t('bus.nodes')}</caption>
            <thead><tr><th scope="col">{t('bus.node')}</th><th scope="col" class="number">{t('bus.replies')}</th><th scope="col" class="number">{t('bus.timeouts')}</th>
              <th scope="col" class="number">{t('bus.corrupt')}</th><th scope="col" class="number">{t('bus.refused')}</th>
              <th scope="col" class="number">{t('bus.turnaround')}</th><th scope="col">{t('column.state')}</th></tr></thead>
            <tbody>{statistics.nodes.map((node) => <Node key={node.node} node={node} />)}</tbody>
          </table>
          <table>
            <caption>{t('bus.classes')}</caption>
            <thead><tr><th scope="col">{t('bus.class')}</th><th scope="col" class="number">{t('bus.sent')}</th><th scope="col" class="number">{t('bus.waiting')}</th>
              <th scope="col" class="number">{t('bus.wait-median')}</th><th scope="col" class="number">{t('bus.wait-longest')}</th></tr></thead>
            <tbody>{statistics.classes.map((one) => {
              const name = classKey(one.transactionClass);
              const counts = one.queueing?.counts ?? [];
              return (
                <tr key={one.transactionClass}>
                  <th scope="row">{name === null ? '?' : t(name)}</th><td class="number">{String(one.sent)}</td><td class="number">{String(one.waiting)}</td>
                  <td class="number">{histogramCount(counts) === 0n ? '-' : `≤ ${span(quantile(counts, 0.5))}`}</td>
                  <td class="number">{histogramCount(counts) === 0n ? '-' : span(milliseconds(one.queueing?.longest))}</td>
                </tr>
              );
            })}</tbody>
          </table>
        </div>
      )}
    </section>
  );
}

export function BusesScreen() {
  useEffect(() => {
    watchesBuses.value = true;
    return () => { watchesBuses.value = false; };
  }, []);
  const live = traffic.state.value === 'live';
  return (
    <div class={live ? '' : 'stale'}>
      {!live && <p class="hint">{t('live.connecting')}</p>}
      {store.buses.value.map((bus) => (
        <BusCard key={bus.name} bus={bus} statistics={store.statistics.value.find((known) => known.bus === bus.name)}
                 budget={store.budgets.value.find((known) => known.bus === bus.name)} />
      ))}
    </div>
  );
}
