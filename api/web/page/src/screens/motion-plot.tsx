// The last motion of an axis: from one second before its start to its predicted end.
import { useComputed } from '@preact/signals';
import type { Command } from '@proto/types_pb';
import { store } from '../app';
import { t } from '../i18n';
import type { AxisEntry } from '../model/store';
import { thin, type Trace } from '../model/series';
import { moveTime } from '../model/profile';
import { BEFORE_MS } from '../model/record';
import { instant, milliseconds } from '../model/wire';
import { inSeconds, type Line, type Mark } from '../ui/chart-spec';
import { ChartView, Legend } from '../ui/chart-view';
import { panel } from '../settings';

const LEAST_MS = 5000;

/** When a move should be done, by what its drive was given; null: that cannot be said. */
export function predictedEnd(command: Command | undefined, entry: AxisEntry): number | null {
  const started = instant(command?.startedAt);
  const granted = command?.granted;
  const target = granted?.position ?? command?.asked?.position;
  if (command === undefined || started === null || target === undefined || granted?.velocity === undefined) return null;
  const { series } = entry;
  const begin = Math.min(series.find(started), series.length - 1);
  if (begin < 0) return null;
  const time = moveTime(target - series.sample(begin).position, granted.velocity, milliseconds(granted.accelerationTime) ?? 0,
                        milliseconds(granted.decelerationTime) ?? 0);
  return time === null ? null : started + time;
}

export function MotionPlot({ entry, active, scope }: { entry: AxisEntry; active: Command | undefined; scope: () => void }) {
  const { name } = entry;
  const record = useComputed(() => store.records.value.find((known) => known.axis === name && known.why === 'motion'));
  const unit = useComputed(() => entry.state.value.unit).value;
  const lines: Line[] = [
    { label: t('quantity.position'), scale: unit, style: 0 }, { label: t('quantity.velocity'), scale: `${unit}/s`, style: 1 },
    { label: t('quantity.target'), scale: unit, style: 2, stepped: true }];
  const picture = () => {
    store.tick.value;
    const { series } = entry;
    const last = series.length === 0 ? Date.now() : series.at(series.length - 1);
    const moving = entry.state.peek().moving;
    const command = active ?? store.commands.peek().find((known) => known.axis === name && known.startedAt !== undefined);
    const started = moving ? instant(command?.startedAt) : null;
    const done = record.value;
    const end = predictedEnd(command, entry);
    const marks: Mark[] = [];
    let from = last - LEAST_MS;
    let to = last;
    if (started !== null && started > from - 60_000) {
      from = started - BEFORE_MS;
      to = Math.max(last, from + LEAST_MS, active !== undefined ? end ?? 0 : 0);
    } else if (!moving && done !== undefined && done.samples.length > 0) {
      from = done.samples[0]!.at;
      to = Math.max(done.samples[done.samples.length - 1]!.at, from + 2000);
      marks.push({ at: done.at / 1000, text: t('plot.start'), style: 'dashed' });
    }
    if (end !== null && end > from && end <= to + 1) marks.push({ at: end / 1000, text: t('plot.predicted'), style: 'dashed' });
    const traces = (['position', 'velocity', 'target'] as const).map((quantity): Trace => inSeconds(thin(series, quantity, from, to, 500), 0));
    return { traces, from: from / 1000, to: to / 1000, marks };
  };
  return (
    <section class="card plot" aria-label={t('plot.title')}>
      <div class="plot-head">
        <h2>{t('plot.title')}</h2>
        <Legend lines={lines} />
        <button class="button quiet" onClick={scope}>{t('plot.scope')}</button>
      </div>
      <ChartView spec={{ lines, height: panel.value ? 240 : 230, clock: true }} picture={picture} label={t('plot.title')} />
    </section>
  );
}
