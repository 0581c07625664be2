// Several axes on one time axis: live, or of a motion that was recorded, or two of them on top of each other.
import { signal, useComputed } from '@preact/signals';
import { useEffect, useRef } from 'preact/hooks';
import { store } from '../app';
import { clockFormat, t } from '../i18n';
import { csv, type Table } from '../model/csv';
import { decimals, shown, spanText, typed } from '../model/numbers';
import type { Record as Recording, Trigger } from '../model/record';
import { listed, thin, type Quantity, type Trace } from '../model/series';
import { State } from '@proto/types_pb';
import { route } from '../route';
import { panel } from '../settings';
import { Choice } from '../ui/choices';
import type { Chart } from '../ui/chart';
import { inSeconds, type Line, type Mark } from '../ui/chart-spec';
import { ChartView, Legend } from '../ui/chart-view';
import { download, picture as pngOf } from '../ui/download';
import { NumberField } from '../ui/field';
import { valueAt } from '../model/cursor';

type View = { of: 'live' } | { of: 'record'; ids: readonly number[] };

const chosen = signal<readonly string[]>([]);
const quantities = signal<readonly Quantity[]>(['position', 'velocity']);
const span = signal(30_000);
/** Milliseconds since 1970 of the right edge, while the picture stands still. */
const paused = signal<number | null>(null);
const view = signal<View>({ of: 'live' });
const cursors = signal<{ a: number | null; b: number | null; next: 'a' | 'b' }>({ a: null, b: null, next: 'a' });
const triggerKind = signal<Trigger['on']>('motion');
const triggerTerminal = signal('');
const triggerEdge = signal<'rising' | 'falling'>('rising');
const triggerQuantity = signal<'position' | 'velocity'>('position');
const level = signal('0');
const single = signal(false);

const WINDOWS = [10_000, 30_000, 60_000, 600_000];
const MOST_AXES = 6;

/** A curve of the picture: where its samples are, and from when on they count. */
interface Source { label: string; unit: string; axis: string; zero: number; terminals: readonly string[]; samples: Parameters<typeof thin>[0] }

const terminalsOf = (axis: string): string[] => {
  const state = store.axis(axis)?.state.peek();
  return state === undefined ? [] : [...state.inputs, ...state.outputs].map(({ name }) => name);
};

const recordTitle = (record: Recording): string =>
  `${record.axis} ${clockFormat.value.format(new Date(record.at))}`;

function sources(): Source[] {
  const now = view.value;
  if (now.of === 'live') {
    return chosen.value.flatMap((axis) => {
      const entry = store.axis(axis);
      return entry === undefined ? [] : [{ label: axis, unit: entry.state.peek().unit, axis, zero: 0, terminals: terminalsOf(axis), samples: entry.series }];
    });
  }
  return now.ids.flatMap((id) => {
    const record = store.records.value.find((known) => known.id === id);
    return record === undefined ? [] : [{ label: recordTitle(record), unit: record.unit, axis: record.axis, zero: record.at,
                                           terminals: terminalsOf(record.axis), samples: listed(record.samples) }];
  });
}

/** Edges of the picture, as times of each source less its zero. */
function edges(all: readonly Source[]): [number, number] {
  if (view.value.of === 'live') {
    const newest = Math.max(0, ...all.map(({ samples }) => (samples.length === 0 ? 0 : samples.at(samples.length - 1))));
    const to = paused.value ?? (newest === 0 ? Date.now() : newest);
    return [to - span.value, to];
  }
  const from = Math.min(-1000, ...all.map(({ samples, zero }) => (samples.length === 0 ? 0 : samples.at(0) - zero)));
  const to = Math.max(1000, ...all.map(({ samples, zero }) => (samples.length === 0 ? 0 : samples.at(samples.length - 1) - zero)));
  return [from, to];
}

const unitOf = (quantity: Quantity, unit: string): string => (quantity === 'velocity' ? `${unit}/s` : unit);

function QuantityChart({ quantity, keep }: { quantity: Quantity; keep: (chart: Chart | null) => void }) {
  const all = sources();
  const lines: Line[] = all.map(({ label, unit }, index) => ({ label, scale: unitOf(quantity, unit), style: index, stepped: quantity === 'target' }));
  const live = view.value.of === 'live';
  const picture = () => {
    // A long stretch changes too little to be drawn with each batch.
    if (paused.value === null && live) { if (span.value <= 60_000) store.tick.value; else slowTick.value; }
    const now = sources();
    const [from, to] = edges(now);
    const traces = now.map(({ samples, zero }): Trace => inSeconds(thin(samples, quantity, from + zero, to + zero, 600), zero));
    const { a, b } = cursors.value;
    const marks: Mark[] = [];
    if (!live) marks.push({ at: 0, text: t('scope.trigger-mark'), style: 'dashed' });
    if (a !== null) marks.push({ at: a, text: 'A', style: 'solid' });
    if (b !== null) marks.push({ at: b, text: 'B', style: 'solid' });
    return { traces, from: from / 1000, to: to / 1000, marks };
  };
  const pick = (at: number) => {
    if (live && paused.peek() === null) paused.value = edges(sources())[1];
    const { next } = cursors.peek();
    cursors.value = { ...cursors.peek(), [next]: at, next: next === 'a' ? 'b' : 'a' };
  };
  const height = quantities.value.length === 1 ? 420 : panel.value ? 200 : 260;
  return (
    <div class="scope-chart">
      <h2 class="minor">{t(`quantity.${quantity}`)}</h2>
      <ChartView spec={{ lines, height, clock: live, pick }} picture={picture} keep={keep} label={t(`quantity.${quantity}`)} />
    </div>
  );
}

const slowTick = signal(0);

function Readings() {
  const { a, b } = cursors.value;
  if (a === null && b === null) return <p class="hint">{t('scope.tap')}</p>;
  const all = sources();
  const time = (at: number | null) => (at === null ? '-' : view.value.of === 'live' ? clockFormat.value.format(new Date(at * 1000)) : `${shown(at, 3)} s`);
  return (
    <table class="readings">
      <thead><tr><th scope="col" /><th scope="col" class="number">A {time(a)}</th><th scope="col" class="number">B {time(b)}</th>
        <th scope="col" class="number">Δ {a !== null && b !== null ? spanText(Math.abs(b - a) * 1000) : '-'}</th></tr></thead>
      <tbody>{all.flatMap((source) => quantities.value.map((quantity) => {
        const unit = unitOf(quantity, source.unit);
        const digits = decimals(unit);
        const at = (cursor: number | null) => (cursor === null ? null : valueAt(source.samples, quantity, cursor * 1000 + source.zero));
        const left = at(a);
        const right = at(b);
        const text = (value: number | null) => (value === null ? '-' : `${shown(value, digits)} ${unit}`);
        return (
          <tr key={`${source.label}${quantity}`}>
            <th scope="row">{source.label} {t(`quantity.${quantity}`)}</th><td class="number">{text(left)}</td><td class="number">{text(right)}</td>
            <td class="number">{left !== null && right !== null ? text(right - left) : '-'}</td>
          </tr>
        );
      }))}</tbody>
    </table>
  );
}

function exportCsv(): void {
  const all = sources();
  const [from, to] = edges(all);
  const tables = all.map(({ axis, unit, terminals, zero, samples }): Table => {
    const begin = samples.find(from + zero);
    const list = [];
    for (let index = begin; index < samples.length && samples.at(index) <= to + zero; ++index) list.push(samples.sample(index));
    return { axis, unit, terminals, samples: list };
  });
  const text = csv(tables, (state) => (State[state] ?? String(state)).toLowerCase());
  download(`axisd-${all.map(({ axis }) => axis.replace('/', '.')).join('-') || 'scope'}.csv`, new Blob([text], { type: 'text/csv' }));
}

function TriggerChoice() {
  const axes = chosen.value;
  const names = [...new Set(axes.flatMap(terminalsOf))];
  const terminal = names.includes(triggerTerminal.value) ? triggerTerminal.value : names[0] ?? '';
  const first = axes[0];
  const value = typed(level.value);
  useEffect(() => {
    const kind = triggerKind.value;
    if (kind === 'edge') {
      const index = first === undefined ? -1 : terminalsOf(first).indexOf(terminal);
      store.trigger.value = index < 0 ? { on: 'motion' } : { on: 'edge', terminal: index, name: terminal, rising: triggerEdge.value === 'rising' };
    } else if (kind === 'level') {
      store.trigger.value = value === null ? { on: 'motion' }
        : { on: 'level', quantity: triggerQuantity.value, level: value, rising: triggerEdge.value === 'rising' };
    } else store.trigger.value = { on: kind };
  }, [triggerKind.value, terminal, triggerEdge.value, triggerQuantity.value, value, first]);
  const unit = first === undefined ? '' : store.axis(first)?.state.peek().unit ?? '';
  return (
    <div class="row trigger">
      <Choice label={t('scope.trigger')} value={triggerKind.value} pick={(kind) => { triggerKind.value = kind; }} options={[
        { id: 'motion', name: t('scope.on-motion') }, { id: 'edge', name: t('scope.on-edge') },
        { id: 'level', name: t('scope.on-level') }, { id: 'fault', name: t('scope.on-fault') }]} />
      {triggerKind.value === 'edge' && (
        <label class="field"><span class="caption">{t('scope.terminal')}</span><span class="box">
          <select value={terminal} onChange={(event) => { triggerTerminal.value = event.currentTarget.value; }}>
            {names.map((name) => <option key={name} value={name}>{name}</option>)}</select></span></label>
      )}
      {triggerKind.value === 'level' && (
        <>
          <Choice label={t('scope.quantity')} value={triggerQuantity.value} pick={(id) => { triggerQuantity.value = id; }}
                  options={[{ id: 'position', name: t('quantity.position') }, { id: 'velocity', name: t('quantity.velocity') }]} />
          <NumberField value={level} label={t('scope.level')} unit={unitOf(triggerQuantity.value, unit)} />
        </>
      )}
      {(triggerKind.value === 'edge' || triggerKind.value === 'level') && (
        <Choice label={t('scope.edge')} value={triggerEdge.value} pick={(id) => { triggerEdge.value = id; }}
                options={[{ id: 'rising', name: t('scope.rising') }, { id: 'falling', name: t('scope.falling') }]} />
      )}
      <button class="button" aria-pressed={single.value} onClick={() => { single.value = !single.peek(); }}>{t('scope.single')}</button>
    </div>
  );
}

function Records() {
  const records = store.records.value;
  const now = view.value;
  const ids = now.of === 'record' ? now.ids : [];
  if (records.length === 0) return <p class="empty">{t('scope.no-records')}</p>;
  const toggle = (id: number) => {
    // Two at a time: with a third the older choice goes.
    const next = ids.includes(id) ? ids.filter((known) => known !== id) : [...ids, id].slice(-2);
    cursors.value = { a: null, b: null, next: 'a' };
    view.value = next.length === 0 ? { of: 'live' } : { of: 'record', ids: next };
  };
  return (
    <ul class="records">{records.map((record) => (
      <li key={record.id}>
        <button class="button" aria-pressed={ids.includes(record.id)} onClick={() => toggle(record.id)}>
          <b>{record.axis}</b><time>{clockFormat.value.format(new Date(record.at))}</time>
          <small>{t(`why.${record.why}`)}{record.detail !== '' && ` ${record.detail}`}, {spanText((record.samples[record.samples.length - 1]?.at ?? record.at) - record.at)}</small>
        </button>
      </li>
    ))}</ul>
  );
}

export function ScopeScreen() {
  const { of } = route.value;
  const names = store.names.value;
  const charts = useRef(new Map<Quantity, Chart>());
  useEffect(() => {
    const known = chosen.peek().filter((name) => names.includes(name));
    if (of !== '' && names.includes(of) && !known.includes(of)) chosen.value = [of];
    else if (known.length === 0 && names[0] !== undefined) chosen.value = [of !== '' && names.includes(of) ? of : names[0]];
    else if (known.length !== chosen.peek().length) chosen.value = known;
  }, [of, names.join()]);
  useEffect(() => {
    const timer = setInterval(() => { slowTick.value += 1; }, 500);
    return () => clearInterval(timer);
  }, []);
  const newest = useComputed(() => store.records.value[0]?.id ?? 0);
  const seen = useRef(newest.peek());
  useEffect(() => {
    const id = newest.value;
    if (id <= seen.current) return;
    seen.current = id;
    // Once: the picture stands still with what was caught.
    const record = store.records.peek()[0]!;
    if (single.peek() && record.why === triggerKind.peek()) { view.value = { of: 'record', ids: [id] }; single.value = false; }
  }, [newest.value]);
  const live = view.value.of === 'live';
  const toggleAxis = (name: string) => {
    chosen.value = chosen.peek().includes(name) ? chosen.peek().filter((known) => known !== name) : [...chosen.peek(), name].slice(-MOST_AXES);
  };
  const toggle = (quantity: Quantity) => {
    const now = quantities.peek();
    if (!now.includes(quantity)) quantities.value = [...now, quantity];
    else if (now.length > 1) quantities.value = now.filter((known) => known !== quantity);
  };
  const shift = (by: number) => {
    paused.value = (paused.peek() ?? edges(sources())[1]) + by * span.peek();
  };
  const lines = sources().map(({ label }, index) => ({ label, style: index }));
  return (
    <div class="scope">
      <section class="card scope-main" aria-label={t('nav.scope')}>
        <div class="row">
          <Choice label={t('scope.window')} value={String(span.value)} pick={(id) => { span.value = Number(id); view.value = { of: 'live' }; }}
                  options={WINDOWS.map((ms) => ({ id: String(ms), name: ms < 60_000 ? `${ms / 1000} s` : `${ms / 60_000} min` }))} />
          <button class="button" aria-pressed={live && paused.value === null} onClick={() => {
            if (!live) { view.value = { of: 'live' }; paused.value = null; cursors.value = { a: null, b: null, next: 'a' }; }
            else paused.value = paused.peek() === null ? edges(sources())[1] : null;
          }}>{live && paused.value === null ? t('scope.pause') : t('scope.live')}</button>
          {live && <><button class="button" aria-label={t('scope.earlier')} onClick={() => shift(-0.5)}>‹</button>
            <button class="button" aria-label={t('scope.later')} onClick={() => shift(0.5)}>›</button></>}
          <button class="button" onClick={() => { cursors.value = { a: null, b: null, next: 'a' }; }}>{t('scope.clear')}</button>
          <span class="grow" />
          <button class="button" data-act="csv" onClick={exportCsv}>CSV</button>
          <button class="button" data-act="png" onClick={() => pngOf([...charts.current.values()].map(({ plot }) => plot.ctx.canvas), lines.map(({ label }) => label))}>PNG</button>
        </div>
        <Legend lines={lines} />
        {quantities.value.map((quantity) => (
          <QuantityChart key={quantity} quantity={quantity} keep={(chart) => {
            if (chart === null) charts.current.delete(quantity); else charts.current.set(quantity, chart);
          }} />
        ))}
        <Readings />
      </section>
      <aside class="card scope-side">
        <h2>{t('scope.axes')}</h2>
        <div class="chips">{names.map((name) => (
          <button key={name} class="button" aria-pressed={chosen.value.includes(name)} onClick={() => toggleAxis(name)}>{name}</button>))}</div>
        <h2>{t('scope.curves')}</h2>
        <div class="chips">{(['position', 'velocity', 'target', 'error'] as const).map((quantity) => (
          <button key={quantity} class="button" aria-pressed={quantities.value.includes(quantity)} onClick={() => toggle(quantity)}>{t(`quantity.${quantity}`)}</button>))}</div>
        <h2>{t('scope.trigger')}</h2>
        <TriggerChoice />
        <h2>{t('scope.records')}</h2>
        <p class="hint">{t('scope.compare')}</p>
        <Records />
      </aside>
    </div>
  );
}
