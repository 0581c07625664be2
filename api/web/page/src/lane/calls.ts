// Starts and releases: over the lane, so that a stop that is asked for after them comes after them, and one that was held up
// on its way is dropped there.
import { create, fromBinary, toBinary, type DescMessage, type DescMethodUnary, type MessageInitShape, type MessageShape } from '@bufbuild/protobuf';
import { t } from '../i18n';
import { detailOf } from '../model/wire';
import { Kind, type Answer } from './frame';
import type { Lane } from './lane';

/** It was sent, and nobody knows what became of it. */
export class NoAnswer extends Error {
  constructor() { super(t('lane.no-answer')); }
}

const ANSWER_MS = 2000;

/** Asks, and gives the response. Throws the daemon's ErrorDetail; NoAnswer; or an Error that says why nothing was sent. */
export async function byLane<I extends DescMessage, O extends DescMessage>(
    lane: Lane, method: DescMethodUnary<I, O>, request: MessageInitShape<I>): Promise<MessageShape<O>> {
  if (lane.state.peek() !== 'open') throw new Error(t('page.lane-closed'));
  const message = toBinary(method.input, create(method.input, request));
  const answer = await answered(lane.call(`${method.parent.typeName}/${method.name}`, message));
  if (answer.kind === Kind.answer && answer.status === 0) return fromBinary(method.output, answer.response);
  if (answer.kind === Kind.droppedAsLate) throw new Error(t('lane.late'));
  throw detailOf(answer.details) ?? new Error(answer.message || `${answer.kind}/${answer.status}`);
}

async function answered(waiting: Promise<Answer>): Promise<Answer> {
  let timer: ReturnType<typeof setTimeout> | undefined;
  const over = new Promise<never>((_, reject) => { timer = setTimeout(() => reject(new NoAnswer()), ANSWER_MS); });
  try {
    // A lane that was lost has sent it.
    return await Promise.race([waiting.catch(() => { throw new NoAnswer(); }), over]);
  } finally { clearTimeout(timer); }
}
