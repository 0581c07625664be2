// Commands of this page. Each is sent once, under the page's lease, valid for two seconds by the daemon's clock: one that is
// held up on its way is refused there.
import { create } from '@bufbuild/protobuf';
import { BufferMode, CommandState, WaitUntil, type Command } from '@proto/types_pb';
import type { CommandOptionsSchema } from '@proto/types_pb';
import type { MessageInitShape } from '@bufbuild/protobuf';
import { MoveGroupRequestSchema, type GroupMove, type GroupTarget } from '@proto/group_service_pb';
import { store, tokenFor } from './app';
import { timestamp } from './model/wire';
import { CALL_MS, clients, problem } from './transport/clients';
import { notify, settle, type Text } from './ui/notices';
import { reasonKey } from './i18n/names';
import { t, type Key } from './i18n';

const VALID_MS = 2000;

/** Null: the daemon's clock is not known, as nothing is live. */
export function options(token: bigint): MessageInitShape<typeof CommandOptionsSchema> | null {
  const now = store.clock.at(performance.now());
  if (now === null) return null;
  return { requestId: crypto.randomUUID(), leaseToken: token, notAfter: timestamp(now + VALID_MS),
           bufferMode: BufferMode.ABORTING, waitUntil: WaitUntil.ACCEPTED };
}

const endings: { [state: number]: { level: 'done' | 'warning' | 'error'; key: Key } } = {
  [CommandState.DONE]: { level: 'done', key: 'command.done' },
  [CommandState.ABORTED]: { level: 'warning', key: 'command.aborted' },
  [CommandState.ERROR]: { level: 'error', key: 'command.error' },
  [CommandState.UNKNOWN]: { level: 'error', key: 'command.unknown' },
};

/** Shows what becomes of a command until it has ended. */
async function follow(id: number, what: string, command: Command): Promise<void> {
  const shown = (now: Command): boolean => {
    const ending = endings[now.state];
    if (ending === undefined) return false;
    settle(id, ending.level, { key: ending.key, values: { what } }, now.cause?.message);
    return true;
  };
  if (shown(command)) return;
  store.mergeCommands([command]);
  const unsubscribe = store.commands.subscribe((commands) => {
    const now = commands.find((known) => known.id === command.id);
    // The store keeps the newest: one that is not there any more ended long ago.
    if (now === undefined || shown(now)) queueMicrotask(() => unsubscribe());
  });
}

/** Calls, and says what came of it. */
async function commanded(what: string, call: () => Promise<Command | undefined>): Promise<boolean> {
  const id = notify('busy', { key: 'command.sent', values: { what } });
  try {
    const command = await call();
    if (command === undefined) throw new Error('no command in the answer');
    settle(id, 'busy', { key: 'command.accepted', values: { what } });
    void follow(id, what, command);
    return true;
  } catch (error) {
    const detail = problem(error);
    settle(id, 'error', { key: 'command.refused', values: { what } },
           [reasonWord(detail.reason), detail.message, detail.remedy].filter(Boolean).join(': '));
    return false;
  }
}

const reasonWord = (reason: number): string => { const key = reasonKey(reason); return key === null ? '' : t(key); };

const timed = { timeoutMs: CALL_MS };
const needed = (token: bigint) => {
  const given = options(token);
  if (given === null) throw new Error(t('page.nothing-live'));
  return given;
};

export const enable = (axis: string) => commanded(`${t('action.enable')} ${axis}`, async () =>
  (await clients.axes.enable({ axis, options: needed(tokenFor(axis)) }, timed)).command);
export const disable = (axis: string) => commanded(`${t('action.disable')} ${axis}`, async () =>
  (await clients.axes.disable({ axis, options: needed(tokenFor(axis)) }, timed)).command);
export const home = (axis: string) => commanded(`${t('action.home')} ${axis}`, async () =>
  (await clients.axes.home({ axis, options: needed(tokenFor(axis)) }, timed)).command);
export const reset = (axis: string) => commanded(`${t('action.reset')} ${axis}`, async () =>
  (await clients.axes.reset({ axis, options: needed(tokenFor(axis)) }, timed)).command);
export const moveTo = (axis: string, position: number, velocity: number | undefined, unit: string) =>
  commanded(`${t('action.move')} ${axis} ${position} ${unit}`, async () => (await clients.axes.moveAbsolute(
    { axis, position, ...(velocity === undefined ? {} : { velocity }), options: needed(tokenFor(axis)) }, timed)).command);
export const moveBy = (axis: string, distance: number, velocity: number | undefined, unit: string) =>
  commanded(`${t('action.move')} ${axis} ${distance > 0 ? '+' : ''}${distance} ${unit}`, async () => (await clients.axes.moveRelative(
    { axis, distance, ...(velocity === undefined ? {} : { velocity }), options: needed(tokenFor(axis)) }, timed)).command);

/** A move of several axes. Null: it was refused, and said so. */
export async function moveGroup(group: string, targets: readonly Omit<GroupTarget, '$typeName' | '$unknown'>[], together: boolean,
                                token: bigint): Promise<GroupMove | null> {
  const what = `${t('action.move')} ${group}`;
  const id = notify('busy', { key: 'command.sent', values: { what } });
  try {
    const request = create(MoveGroupRequestSchema, { group, targets: targets.map((target) => ({ ...target })), arriveTogether: together,
                                                     options: needed(token) });
    const { move } = await clients.groups.moveGroup(request, timed);
    settle(id, 'busy', { key: 'command.accepted', values: { what } });
    return move ?? null;
  } catch (error) {
    const detail = problem(error);
    settle(id, 'error', { key: 'command.refused', values: { what } }, [reasonWord(detail.reason), detail.message, detail.remedy].filter(Boolean).join(': '));
    return null;
  }
}

/** Anything else that is asked of the daemon by a button: it says what came of it. */
export async function asked(what: Text, call: () => Promise<unknown>): Promise<boolean> {
  const id = notify('busy', what);
  try {
    await call();
    settle(id, 'done', what);
    return true;
  } catch (error) {
    const detail = problem(error);
    settle(id, 'error', what, [reasonWord(detail.reason), detail.message, detail.remedy].filter(Boolean).join(': '));
    return false;
  }
}
