// Axes that move together.
import { signal, useComputed, useSignal, type Signal } from '@preact/signals';
import { useEffect, useMemo } from 'preact/hooks';
import type { Group, GroupMove } from '@proto/group_service_pb';
import { CommandState } from '@proto/types_pb';
import { endControl, store, tokenFor } from '../app';
import { pageObstacle, obstacleOf, type Obstacle } from '../explain';
import { t } from '../i18n';
import { endKey, reasonKey } from '../i18n/names';
import { spanText, typed } from '../model/numbers';
import { milliseconds } from '../model/wire';
import { moveGroup } from '../motion';
import { haltGroup, stopGroup } from '../stops';
import { CALL_MS, clients } from '../transport/clients';
import { ActButton, Explanations, type Act } from '../ui/explained';
import { NumberField } from '../ui/field';
import { StateMark, tone } from '../ui/marks';
import { askTakeControl } from '../ui/questions';
import { pressed } from '../ui/stop-rail';
import { positionText, stateText } from '../ui/words';
import { go, hrefOf } from '../route';
import { Choice } from '../ui/choices';
import { AGAIN_MS, signature } from '../explain';

const moves = signal<ReadonlyMap<string, GroupMove>>(new Map());
const ended = (state: CommandState) => state >= CommandState.DONE;
const span = (value: number | null) => (value === null ? '-' : spanText(value));

/** Asks how a move stands until it has ended. */
async function follow(group: string, move: GroupMove): Promise<void> {
  moves.value = new Map(moves.peek()).set(group, move);
  while (!ended(move.state)) {
    await new Promise((resolve) => setTimeout(resolve, 200));
    if (moves.peek().get(group)?.id !== move.id) return;
    try {
      const answer = await clients.groups.getGroupMove({ id: move.id }, { timeoutMs: CALL_MS });
      if (answer.move === undefined) return;
      move = answer.move;
      moves.value = new Map(moves.peek()).set(group, move);
    } catch { return; }
  }
}

function MoveReport({ move }: { move: GroupMove }) {
  const key = endKey(move.state);
  const reason = move.cause === undefined ? null : reasonKey(move.cause.reason);
  const latest = Math.max(1, ...move.members.map(({ arrivedAfter, predictedDuration }) =>
    Math.max(milliseconds(arrivedAfter) ?? 0, milliseconds(predictedDuration) ?? 0)));
  return (
    <section class="group-move" aria-live="polite">
      <p><b>{key === null ? '?' : t(key)}</b>{move.cause !== undefined && <> · {reason !== null && `${t(reason)}: `}{move.cause.message}</>}</p>
      <dl class="figures">
        <div><dt>{t('group.skew')}</dt><dd>{span(milliseconds(move.startSkew))}</dd></div>
        <div><dt>{t('group.arrival')}</dt><dd>{span(milliseconds(move.arrivalError))}</dd></div>
        <div><dt>{t('group.predicted')}</dt><dd>{span(milliseconds(move.predictedArrivalError))}</dd></div>
      </dl>
      <table>
        <thead><tr><th scope="col">{t('column.axis')}</th><th scope="col">{t('group.started')}</th><th scope="col">{t('group.arrived')}</th><th scope="col">{t('column.note')}</th></tr></thead>
        <tbody>{move.members.map(({ command, startedAfter, arrivedAfter, bySync, startNote }) => {
          const begin = ((milliseconds(startedAfter) ?? 0) / latest) * 100;
          const end = ((milliseconds(arrivedAfter) ?? 0) / latest) * 100;
          return (
            <tr key={command?.axis}>
              <th scope="row">{command?.axis}</th>
              <td class="number">{span(milliseconds(startedAfter))}</td>
              <td class="number">{span(milliseconds(arrivedAfter))}
                <svg class="bar" viewBox="0 0 100 6" preserveAspectRatio="none" aria-hidden="true"><rect class="all" width="100" height="6" />
                  <rect class="part" x={begin} width={Math.max(0, end - begin)} height="6" /></svg></td>
              <td>{bySync ? t('group.by-sync') : startNote}</td>
            </tr>
          );
        })}</tbody>
      </table>
    </section>
  );
}

/** The first thing in the way of any member. */
function useMemberObstacle(group: Group): Signal<Obstacle | null> {
  const found = useSignal<Obstacle | null>(null);
  const watched = useComputed(() => group.axes.map((axis) => {
    const entry = store.axis(axis);
    return entry === undefined ? '' : `${signature(entry.state.value)}#${tokenFor(axis)}`;
  }).join(';'));
  const key = watched.value;
  const again = useSignal(0);
  useEffect(() => {
    const controller = new AbortController();
    let timer = setTimeout(async () => {
      for (const axis of group.axes) {
        try {
          const { obstacles } = await clients.system.explain(
            { axis, command: { case: 'moveRelative', value: { distance: 1 } }, leaseToken: tokenFor(axis) },
            { timeoutMs: CALL_MS, signal: controller.signal });
          const first = obstacles.find(({ blocking, detail }) => blocking && detail !== undefined && detail.permitted === undefined)?.detail;
          if (first !== undefined) {
            const obstacle = obstacleOf(first, { held: (store.axis(axis)?.state.peek().holds.length ?? 0) > 0 });
            found.value = { ...obstacle, text: obstacle.text.startsWith(`${axis}: `) ? obstacle.text : `${axis}: ${obstacle.text}` };
            timer = setTimeout(() => { again.value += 1; }, AGAIN_MS);
            return;
          }
        } catch { return; }
      }
      found.value = null;
    }, 100);
    return () => { clearTimeout(timer); controller.abort(); };
  }, [key, again.value]);
  return found;
}

function GroupCard({ group }: { group: Group }) {
  const together = useSignal(true);
  const targets = useMemo(() => new Map(group.axes.map((axis) => [axis, signal('')])), [group.name]);
  const members = useMemberObstacle(group);
  const page = group.axes.map((axis) => pageObstacle(axis)).find((obstacle) => obstacle !== null) ?? null;
  const wanted = [...targets].flatMap(([axis, text]) => {
    const position = typed(text.value);
    return position === null ? [] : [{ axis, target: { case: 'position' as const, value: position } }];
  });
  const bad = [...targets.values()].some(({ value }) => value !== '' && typed(value) === null);
  const none: Obstacle | null = wanted.length === 0 || bad ? { word: '', text: t('group.type-targets'), remedy: null, hint: '' } : null;
  const act: Act = { id: 'move', label: t('action.move'), obstacle: page ?? members.value ?? none };
  const blocked = members.value?.text.split(':')[0] ?? group.axes[0] ?? '';
  const mine = group.axes.every((axis) => tokenFor(axis) !== 0n);
  const move = moves.value.get(group.name);
  return (
    <section class="card group" aria-label={group.name}>
      <h2>{group.name}</h2>
      <ul class="members">
        {group.axes.map((axis) => {
          const entry = store.axis(axis);
          if (entry === undefined) return null;
          const state = entry.state.value;
          return (
            <li key={axis} class={`${tone(state)} ${entry.stale.value ? 'stale' : ''}`}>
              <a href={hrefOf('axis', axis)} onClick={(event) => { event.preventDefault(); go('axis', axis); }}>{axis}</a>
              <span class="badge"><StateMark state={state} />{stateText(state, entry.age.value)}</span>
              <b class="number">{positionText(state, entry.stale.value)}</b>
              <NumberField value={targets.get(axis)!} label={t('axis.move-to')} unit={state.unit} />
            </li>
          );
        })}
      </ul>
      <div class="row">
        {mine ? <button class="button" onClick={() => endControl('released', group.axes)}>{t('action.give-back')}</button>
          : <button class="button primary" data-act="take-control" onClick={() => void askTakeControl(group.axes)}>{t('action.take-control')}</button>}
        <Choice label={t('group.arrive')} value={together.value ? 'together' : 'own'} pick={(id) => { together.value = id === 'together'; }}
                options={[{ id: 'together', name: t('group.together') }, { id: 'own', name: t('group.own-pace') }]} />
        <ActButton act={act} primary run={() => {
          void moveGroup(group.name, wanted, together.peek(), tokenFor(group.axes[0]!)).then((made) => { if (made !== null) void follow(group.name, made); });
        }} />
        <span class="grow" />
        <button class="button" {...pressed(() => void haltGroup(group.name))}>{t('action.halt')}</button>
        <button class="stop" data-stop={group.name} {...pressed(() => void stopGroup(group.name, group.axes))}>{t('stop.one')}<span class="of">{group.name}</span></button>
      </div>
      <Explanations acts={[act]} axis={blocked} axes={group.axes} unit="" />
      {move !== undefined && <MoveReport move={move} />}
    </section>
  );
}

const groups = signal<readonly Group[] | null>(null);

export function GroupsScreen() {
  const live = store.live.value;
  const instance = store.instance.value;
  useEffect(() => {
    if (live) clients.groups.listGroups({}, { timeoutMs: CALL_MS }).then((answer) => { groups.value = answer.groups; }).catch(() => {});
  }, [live, instance]);
  if (groups.value === null) return <p class="empty">{t('live.connecting')}</p>;
  if (groups.value.length === 0) return <p class="empty">{t('group.none')}</p>;
  return <>{groups.value.map((group) => <GroupCard key={group.name} group={group} />)}</>;
}
