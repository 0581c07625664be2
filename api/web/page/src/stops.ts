// Stops: on the lane, and by an ordinary call as well where the lane is closed or slow. To stop twice is harmless.
import { signal } from '@preact/signals';
import { create, fromBinary, toBinary, type DescMessage, type MessageShape } from '@bufbuild/protobuf';
import { AxisService, StopRequestSchema, StopResponseSchema } from '@proto/axis_service_pb';
import { GroupHaltRequestSchema, GroupHaltResponseSchema, GroupService, GroupStopRequestSchema, GroupStopResponseSchema,
         type GroupStopResult } from '@proto/group_service_pb';
import { StopAllRequestSchema, StopAllResponseSchema, SystemService } from '@proto/system_service_pb';
import { WaitUntil, type Command } from '@proto/types_pb';
import type { ErrorDetail } from '@proto/error_pb';
import { HaltRequestSchema, HaltResponseSchema } from '@proto/axis_service_pb';
import { lane } from './app';
import { Kind } from './lane/frame';
import { detailOf } from './model/wire';
import { clients, clientsOf, problem } from './transport/clients';
import { notify } from './ui/notices';

/** What became of a stop of one axis: the command is looked up as it goes on. */
export interface StopOutcome { axis: string; command: Command | null; error: ErrorDetail | string | null }

export interface StopReport {
  what: 'stop' | 'stop-all' | 'group-stop' | 'halt';
  of: string;
  at: Date;
  /** Null: no answer yet. */
  answered: number | null;
  outcomes: readonly StopOutcome[];
  /** It could not be told to anybody. */
  failed: string | null;
}

export const report = signal<StopReport | null>(null);

const SLOW_MS = 250;

/** By the lane; where that is closed, or does not answer in time, by a call as well. */
async function sent<I extends DescMessage, O extends DescMessage>(
    method: string, request: I, message: MessageShape<I>, response: O, byCall: () => Promise<MessageShape<O>>): Promise<MessageShape<O>> {
  let called = false;
  const fallback = () => { called = true; return byCall(); };
  const onLane = lane.call(method, toBinary(request, message)).then((answer) => {
    if (answer.kind === Kind.answer && answer.status === 0) return fromBinary(response, answer.response);
    throw detailOf(answer.details) ?? new Error(answer.message || `the gateway refused (${answer.kind})`);
  });
  const inTime = new Promise<'slow'>((resolve) => setTimeout(() => resolve('slow'), SLOW_MS));
  try {
    const first = await Promise.race([onLane, inTime]);
    if (first !== 'slow') return first;
  } catch (error) {
    if (!called) return fallback();
    throw error;
  }
  return Promise.any([onLane, fallback()]).catch((error: AggregateError) => { throw error.errors[1]; });
}

async function reported(what: StopReport['what'], of: string, run: () => Promise<StopOutcome[]>): Promise<void> {
  const begun = performance.now();
  const mine: StopReport = { what, of, at: new Date(), answered: null, outcomes: [], failed: null };
  report.value = mine;
  const put = (change: Partial<StopReport>) => {
    if (report.peek()?.at === mine.at) report.value = { ...mine, ...change, answered: performance.now() - begun };
  };
  try {
    put({ outcomes: await run() });
  } catch (error) {
    put({ failed: problem(error).message });
  }
}

export function stopAxis(axis: string): Promise<void> {
  const message = create(StopRequestSchema, { axis, options: { requestId: crypto.randomUUID(), waitUntil: WaitUntil.ACCEPTED } });
  return reported('stop', axis, async () => {
    const { command } = await sent(`${AxisService.typeName}/Stop`, StopRequestSchema, message, StopResponseSchema,
                                   () => clients.axes.stop(message));
    return [{ axis, command: command ?? null, error: null }];
  });
}

export function haltAxis(axis: string): Promise<void> {
  const message = create(HaltRequestSchema, { axis, options: { requestId: crypto.randomUUID() } });
  return reported('halt', axis, async () => {
    const { command } = await sent(`${AxisService.typeName}/Halt`, HaltRequestSchema, message, HaltResponseSchema,
                                   () => clients.axes.halt(message));
    return [{ axis, command: command ?? null, error: null }];
  });
}

export function stopAll(): Promise<void> {
  const message = create(StopAllRequestSchema, { waitUntil: WaitUntil.ACCEPTED });
  return reported('stop-all', '', async () => {
    const { results, notDurable } = await sent(`${SystemService.typeName}/StopAll`, StopAllRequestSchema, message, StopAllResponseSchema,
                                   () => clients.system.stopAll(message));
    if (notDurable !== undefined) notify('warning', { plain: notDurable.message }, notDurable.remedy);
    return results.map(({ axis, command, error }) => ({ axis, command: command ?? null, error: error ?? null }));
  });
}

/** Each of several machines, by a call: this page has a lane to none of them. */
export function stopMachines(names: readonly string[]): Promise<void> {
  return reported('stop-all', '', () => Promise.all(names.map((name): Promise<StopOutcome> =>
    clientsOf(name).system.stopAll({ waitUntil: WaitUntil.ACCEPTED }).then(
      ({ results }) => ({ axis: name, command: null, error: results.find(({ error }) => error !== undefined)?.error ?? null }),
      (error: unknown) => ({ axis: name, command: null, error: problem(error) })))));
}

const groupOutcomes = (results: readonly GroupStopResult[]): StopOutcome[] => results.map(({ name, outcome }) => ({
  axis: name, command: outcome.case === 'command' ? outcome.value : null, error: outcome.case === 'error' ? outcome.value : null }));

export function stopGroup(group: string, axes: readonly string[]): Promise<void> {
  const message = create(GroupStopRequestSchema, { group, axes: group === '' ? [...axes] : [], requestId: crypto.randomUUID() });
  return reported('group-stop', group || axes.join(', '), async () => groupOutcomes(
    (await sent(`${GroupService.typeName}/GroupStop`, GroupStopRequestSchema, message, GroupStopResponseSchema,
                () => clients.groups.groupStop(message))).results));
}

export function haltGroup(group: string): Promise<void> {
  const message = create(GroupHaltRequestSchema, { group });
  return reported('halt', group, async () => groupOutcomes(
    (await sent(`${GroupService.typeName}/GroupHalt`, GroupHaltRequestSchema, message, GroupHaltResponseSchema,
                () => clients.groups.groupHalt(message))).results));
}
