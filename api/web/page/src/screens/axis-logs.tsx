// Below an axis: its commands, its events, and its bus.
import { useComputed } from '@preact/signals';
import { store } from '../app';
import { t } from '../i18n';
import type { AxisEntry } from '../model/store';
import { milliseconds } from '../model/wire';
import { spanText } from '../model/numbers';
import { go } from '../route';
import { CommandList, EventList } from './events';

export function AxisLogs({ name, entry }: { name: string; entry: AxisEntry }) {
  const bus = useComputed(() => entry.state.value.bus).value;
  const budget = store.budgets.value.find((known) => known.bus === bus);
  const axis = budget?.axes.find((known) => known.axis === name);
  const load = store.statistics.value.find((known) => known.bus === bus)?.utilisation;
  const bound = budget?.load[budget.load.length - 1]?.utilisation;
  const span = (value: number | null | undefined) => (value === null || value === undefined ? '-' : spanText(value));
  return (
    <>
      <div class="pair">
        <section class="card"><h2>{t('nav.commands')}</h2><CommandList axis={name} most={8} /></section>
        <section class="card"><h2>{t('nav.events')}</h2><EventList axis={name} most={8} /></section>
      </div>
      <section class="card bus-line">
        <h2><a href="/buses" onClick={(event) => { event.preventDefault(); go('buses'); }}>{bus}</a></h2>
        {load !== undefined && <span>{t('bus.load')} <b>{Math.round(load * 100)} %</b>{bound !== undefined && <> {t('bus.of', { bound: `${Math.round(bound * 100)} %` })}</>}</span>}
        {axis !== undefined && (
          <>
            <span>{t('bus.refresh')} <b>{span(milliseconds(axis.observed?.refreshMoving))}</b> {t('bus.of', { bound: span(milliseconds(axis.refreshMovingAll)) })}</span>
            <span>{t('bus.stop')} <b>{span(milliseconds(axis.observed?.stopFrame))}</b> {t('bus.of', { bound: span(milliseconds(axis.stopAlone?.lastFrame)) })}</span>
          </>
        )}
      </section>
    </>
  );
}
