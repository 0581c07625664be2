// Why a button cannot be used now: what the page knows itself, then what the daemon explains.
import { effect, signal, type ReadonlySignal } from '@preact/signals';
import type { MessageInitShape } from '@bufbuild/protobuf';
import { Role } from '@proto/access_pb';
import { Reason, type ErrorDetail } from '@proto/error_pb';
import type { AxisState } from '@proto/types_pb';
import type { ExplainRequestSchema } from '@proto/system_service_pb';
import { lane, roleFor, store, tokenFor } from './app';
import { t } from './i18n';
import { reasonKey } from './i18n/names';
import { remedyOf, type Asked, type Remedy } from './model/remedy';
import { machine } from './route';
import { CALL_MS, clients } from './transport/clients';

export type CommandCase = MessageInitShape<typeof ExplainRequestSchema>['command'];

/** One thing in the way. */
export interface Obstacle { word: string; text: string; remedy: Remedy | null; hint: string }

/** `probe`: it is refused in any case, for what that tells. */
export interface Question { key: string; command: CommandCase; asked: Asked; probe?: true }

export interface Answer { obstacle: Obstacle | null; details: readonly ErrorDetail[] }

const reasonWord = (reason: Reason): string => { const key = reasonKey(reason); return key === null ? '' : t(key); };

export function obstacleOf(detail: ErrorDetail, asked: Asked): Obstacle {
  return { word: reasonWord(detail.reason), text: detail.message, remedy: remedyOf(detail, asked), hint: detail.remedy };
}

/** What forbids any command of this page, before the daemon is asked; null: nothing. Reads signals. */
export function pageObstacle(axis: string): Obstacle | null {
  if (!store.live.value) return { word: '', text: t('page.nothing-live'), remedy: { act: 'reconnect' }, hint: '' };
  const there = store.info.value?.machine ?? '';
  // An address that leads to another machine moves what nobody here looks at.
  if (machine !== '' && there !== machine) return { word: '', text: t('page.other-machine', { machine, there: there || '?' }), remedy: null, hint: '' };
  const role = roleFor(axis);
  if (role === Role.NONE || role === Role.VIEWER) {
    return { word: t('reason.access-denied'), text: t('page.role-too-small'), remedy: { act: 'show', screen: 'people' }, hint: '' };
  }
  if (tokenFor(axis) === 0n) return { word: '', text: t('page.observer'), remedy: { act: 'take-control' }, hint: '' };
  if (lane.state.value !== 'open') return { word: '', text: t('page.lane-closed'), remedy: null, hint: '' };
  return null;
}

/** Whatever of a state the answers may depend on. */
export function signature(state: AxisState): string {
  const bits = [...state.inputs, ...state.outputs].map(({ active }) => (active ? '1' : '0')).join('');
  return [state.state, state.link, state.enabled, state.enabledByDaemon, state.stopHeld, state.inhibited, state.trust, state.alarmCode, state.drift,
          state.leaseHolder, state.fault?.reason ?? 0, state.holds.length, bits, state.moving,
          state.moving ? '' : state.position.toFixed(2)].join('|');
}

const SETTLE_MS = 80;
/** Not all that is in the way shows in the state of the axis. */
export const AGAIN_MS = 1000;

/** Asks the daemon anew whenever the axis or a question changes, and now and then while something is in the way. Ends with
 * `stop`. */
export function watchExplanations(axis: string, questions: ReadonlySignal<readonly Question[]>) {
  const answers = signal<ReadonlyMap<string, Answer>>(new Map());
  let timer: ReturnType<typeof setTimeout> | undefined;
  let controller: AbortController | null = null;
  let asked = '';
  const ask = async (list: readonly Question[], token: bigint) => {
    controller?.abort();
    const own = new AbortController();
    controller = own;
    try {
      const found = await Promise.all(list.map(async ({ key, command, asked: values }): Promise<[string, Answer]> => {
        const { obstacles } = await clients.system.explain({ axis, command: command!, leaseToken: token },
                                                           { timeoutMs: CALL_MS, signal: own.signal });
        const details = obstacles.flatMap(({ blocking, detail }) => (blocking && detail !== undefined ? [detail] : []));
        const state = store.axis(axis)?.state.peek();
        const from = command!.case === 'moveRelative' && state !== undefined ? { base: state.position } : {};
        const meant: Asked = { ...values, ...from, held: (state?.holds.length ?? 0) > 0 };
        return [key, { obstacle: details[0] === undefined ? null : obstacleOf(details[0], meant), details }];
      }));
      if (own.signal.aborted) return;
      const said = new Map(found);
      answers.value = said;
      if (list.some(({ key, probe }) => probe === undefined && said.get(key)!.obstacle !== null)) {
        timer = setTimeout(() => {
          if (store.live.peek()) void ask(list, token);
          else asked = '';  // so that it is, as soon as something is live
        }, AGAIN_MS);
      }
    } catch {
      // Asked anew with the next change; what is unknown forbids nothing, as the daemon decides.
      if (!own.signal.aborted) asked = '';
    }
  };
  const stop = effect(() => {
    const state = store.axis(axis)?.state.value;
    const list = questions.value;
    const token = tokenFor(axis);
    const live = store.live.value;
    if (state === undefined || !live) return;
    const wanted = `${signature(state)}#${token}#${list.map(({ key, asked: values }) => `${key}:${values.position}:${values.velocity}`).join()}`;
    if (wanted === asked) return;
    asked = wanted;
    clearTimeout(timer);
    timer = setTimeout(() => void ask(list, token), SETTLE_MS);
  });
  return { answers, stop: () => { stop(); clearTimeout(timer); controller?.abort(); } };
}
