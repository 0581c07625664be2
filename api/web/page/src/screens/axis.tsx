// One axis: where it is, what it may do, by hand and to a place.
import { useComputed, useSignal } from '@preact/signals';
import { useEffect, useMemo } from 'preact/hooks';
import { CommandState } from '@proto/types_pb';
import { store, tokenFor, endControl } from '../app';
import { pageObstacle, watchExplanations, type Obstacle, type Question } from '../explain';
import { t } from '../i18n';
import { ageText, shown, typed, decimals } from '../model/numbers';
import type { AxisEntry } from '../model/store';
import { disable, enable, home, moveBy, moveTo, reset } from '../motion';
import { go } from '../route';
import { ActButton, describedBy, Explanations, type Act } from '../ui/explained';
import { NumberField } from '../ui/field';
import { JogPad } from '../ui/jog-pad';
import { StateMark, tone } from '../ui/marks';
import { Choice } from '../ui/choices';
import { askTakeControl } from '../ui/questions';
import { leaseText, noteText, positionText, stateText, trustText, velocityText } from '../ui/words';
import { AxisLogs } from './axis-logs';
import { MotionPlot } from './motion-plot';
import { rangesOf, niceSpeed } from '../model/ranges';

/** Far outside of every limit: what stands in its way tells the limits. */
const FAR = 1e12;

function Head({ entry }: { entry: AxisEntry }) {
  const position = useComputed(() => positionText(entry.state.value, entry.stale.value));
  const velocity = useComputed(() => velocityText(entry.state.value, entry.stale.value));
  const target = useComputed(() => {
    const state = entry.state.value;
    return state.target === undefined ? '' : `→ ${shown(state.target, decimals(state.unit))} ${state.unit}`;
  });
  const { name } = entry;
  const state = entry.state.value;
  const note = noteText(state);
  return (
    <section class={`axis-head ${tone(state)} ${entry.stale.value ? 'stale' : ''}`} aria-label={name}>
      <h1>{name}</h1>
      <span class="badge"><StateMark state={state} />{stateText(state, entry.age.value)}</span>
      <output class="big">{position}</output>
      <span class="speed">{velocity} <span class="target">{target}</span></span>
      <span class="facts">
        <span>{trustText(state)}</span>
        <span>{leaseText(entry, tokenFor(name) !== 0n)}</span>
        {entry.stale.value && Number.isFinite(entry.age.value) && <span class="old">{t('live.old', { age: ageText(entry.age.value) })}</span>}
        {state.simulated && <span>{t('axis.simulated')}</span>}
        <span class="where">{state.model} · {state.bus} {state.node}</span>
      </span>
      {note !== '' && <p class="note">{note}</p>}
    </section>
  );
}

export function AxisScreen({ name }: { name: string }) {
  const entry = store.axis(name);
  return entry === undefined ? <p class="empty">{t('page.no-axes')}</p> : <AxisOf entry={entry} />;
}

function AxisOf({ entry }: { entry: AxisEntry }) {
  const { name } = entry;
  const position = useSignal('');
  const velocity = useSignal('');
  const mode = useSignal<'to' | 'by'>('to');
  const jogSpeed = useSignal('');
  const speeds = useSignal<{ slow: number; fast: number } | null>(null);

  const questions = useComputed((): readonly Question[] => {
    const to = typed(position.value);
    const at = typed(velocity.value);
    const jog = speeds.value;
    const profile = at === null ? {} : { velocity: at };
    const list: Question[] = [
      { key: 'enable', command: { case: 'enable', value: {} }, asked: {} },
      { key: 'disable', command: { case: 'disable', value: {} }, asked: {} },
      { key: 'home', command: { case: 'home', value: {} }, asked: {} },
      { key: 'reset', command: { case: 'reset', value: {} }, asked: {} },
      { key: mode.value, asked: { ...(to === null ? {} : { position: to }), ...profile },
        command: mode.value === 'to' ? { case: 'moveAbsolute', value: { position: to ?? entry.state.peek().position, ...profile } }
          : { case: 'moveRelative', value: { distance: to ?? 1, ...profile } } },
      { key: 'ranges', command: { case: 'moveAbsolute', value: { position: FAR, velocity: FAR } }, asked: { position: FAR }, probe: true },
    ];
    if (jog !== null) {
      // What forbids the slow speed forbids the fast one.
      list.push({ key: 'jog+', command: { case: 'jog', value: { velocity: jog.fast } }, asked: { velocity: jog.fast } },
                { key: 'jog-', command: { case: 'jog', value: { velocity: -jog.fast } }, asked: { velocity: jog.fast } });
    }
    return list;
  });
  const explained = useMemo(() => watchExplanations(name, questions), [name]);
  useEffect(() => explained.stop, [explained]);
  const ranges = useComputed(() => rangesOf(explained.answers.value.get('ranges')?.details ?? [], entry.state.peek().unit));

  // Speeds for jogging: what was typed, else a tenth and half of what the axis may.
  const most = ranges.value.velocity?.[1] ?? null;
  const least = ranges.value.velocity?.[0] ?? 0;
  const typedSpeed = typed(jogSpeed.value);
  useEffect(() => {
    if (most === null && typedSpeed === null) return;
    const fast = Math.abs(typedSpeed ?? niceSpeed(most! / 2));
    const slow = Math.max(niceSpeed(fast / 5), least);
    const before = speeds.peek();
    if (before?.fast !== fast || before.slow !== slow) speeds.value = { slow, fast };
  }, [most, least, typedSpeed]);

  const page = useComputed(() => pageObstacle(name));
  const obstacle = (key: string): Obstacle | null => page.value ?? explained.answers.value.get(key)?.obstacle ?? null;
  const unit = useComputed(() => entry.state.value.unit).value;
  const enabled = useComputed(() => entry.state.value.enabled).value;
  const faulty = useComputed(() => entry.state.value.fault !== undefined).value;
  const mine = tokenFor(name) !== 0n;
  const to = typed(position.value);
  const at = typed(velocity.value);
  const noTarget: Obstacle = { word: '', text: t('axis.type-target'), remedy: null, hint: '' };
  const acts: { [id: string]: Act } = {
    enable: { id: 'enable', label: t('action.enable'), obstacle: obstacle('enable') },
    home: { id: 'home', label: t('action.home'), obstacle: obstacle('home') },
    reset: { id: 'reset', label: t('action.reset'), obstacle: obstacle('reset') },
    disable: { id: 'disable', label: t('action.disable'), obstacle: obstacle('disable') },
    move: { id: 'move', label: t('action.move'), obstacle: obstacle(mode.value) ?? (to === null ? noTarget : null) },
    'jog+': { id: 'jog+', label: t('jog.plus'), obstacle: obstacle('jog+') },
    'jog-': { id: 'jog-', label: t('jog.minus'), obstacle: obstacle('jog-') },
  };
  const waits = acts['move']!.obstacle === noTarget;
  const limits = ranges.value.position;
  const range = limits === null ? '' : `, ${t('axis.range', { low: shown(limits[0], 0), high: shown(limits[1], 0) })}`;
  // Without a fault nobody asks why it cannot be reset.
  const told = [acts[enabled ? 'disable' : 'enable']!, acts['home']!, ...(waits ? [] : [acts['move']!]), acts['jog-']!, acts['jog+']!,
                ...(faulty ? [acts['reset']!] : [])];
  const active = store.commands.value.find((command) => command.axis === name && command.state === CommandState.ACTIVE);
  return (
    <div class="axis-screen">
      <Head entry={entry} />
      <section class="controls card" aria-label={t('axis.controls')}>
        <div class="row">
          {mine ? <button class="button" data-act="give-back" onClick={() => endControl('released', [name])}>{t('action.give-back')}</button>
            : <button class="button primary" data-act="take-control" onClick={() => void askTakeControl([name])}>{t('action.take-control')}</button>}
          {enabled ? <ActButton act={acts['disable']!} run={() => void disable(name)} />
            : <ActButton act={acts['enable']!} run={() => void enable(name)} />}
          <ActButton act={acts['home']!} run={() => void home(name)} />
          {faulty && <ActButton act={acts['reset']!} run={() => void reset(name)} />}
        </div>
        <div class="row move">
          <Choice label={t('axis.mode')} value={mode.value} pick={(id) => { mode.value = id; }}
                  options={[{ id: 'to', name: t('axis.to') }, { id: 'by', name: t('axis.by') }]} />
          <NumberField value={position} label={mode.value === 'to' ? `${t('axis.move-to')}${range}` : t('axis.move-by')} unit={unit} />
          <NumberField value={velocity} label={`${t('axis.at')}${most === null ? '' : `, ${t('axis.most', { velocity: shown(most, 0) })}`}`} unit={`${unit}/s`} width={5} />
          <ActButton act={acts['move']!} primary run={() => { if (to !== null) void (mode.peek() === 'to' ? moveTo : moveBy)(name, to, at ?? undefined, unit); }} />
          {waits && <span class="hint" id={describedBy(acts['move']!)}>{t('axis.type-target')}</span>}
        </div>
        <JogPad key={name} axis={name} speeds={speeds.value} unit={unit} plus={acts['jog+']!} minus={acts['jog-']!} typedSpeed={jogSpeed} />
        <Explanations acts={told} axis={name} unit={unit}
                      use={({ field, value }, { id }) => {
                        (id.startsWith('jog') ? jogSpeed : field === 'velocity' ? velocity : position).value = String(Number(value.toFixed(4)));
                      }} />
      </section>
      <MotionPlot entry={entry} active={active} scope={() => go('scope', name)} />
      <AxisLogs name={name} entry={entry} />
    </div>
  );
}
