import assert from 'node:assert/strict';
import { test } from 'node:test';
import { decodeAnswer, encodeRequest, Kind, MOST_BYTES, VERSION } from '../src/lane/frame';
import { byLane, NoAnswer } from '../src/lane/calls';
import { Lane, LaneClosed, type Socket } from '../src/lane/lane';
import { fromBinary, toBinary, create } from '@bufbuild/protobuf';
import { AxisService } from '@proto/axis_service_pb';

test('a request is laid out as the contract says', () => {
  const bytes = encodeRequest(0x01020304, 0x1_0a0b0c0d + 0.7, 'axisd.v1.AxisService/Stop', new Uint8Array([9, 8]));
  const name = new TextEncoder().encode('axisd.v1.AxisService/Stop');
  assert.deepEqual([...bytes], [VERSION, 1, 2, 3, 4, 0x0a, 0x0b, 0x0c, 0x0d, name.length, ...name, 9, 8]);
});

test('what is too long for the lane is not sent', () => {
  assert.throws(() => encodeRequest(1, 0, 'm', new Uint8Array(MOST_BYTES)), RangeError);
});

function answerBytes(kind: number, id: number, status: number, message: string, details: number[], response: number[]): Uint8Array {
  const text = new TextEncoder().encode(message);
  return new Uint8Array([kind, id >>> 24, (id >>> 16) & 255, (id >>> 8) & 255, id & 255, status, text.length >> 8, text.length & 255, ...text,
                         0, 0, 0, details.length, ...details, ...response]);
}

test('an answer is read as the contract says, and what is none is not', () => {
  const bytes = answerBytes(1, 77, 9, 'geht nicht: ä', [1, 2, 3], [4, 5]);
  assert.deepEqual(decodeAnswer(bytes), { kind: 1, id: 77, status: 9, message: 'geht nicht: ä', details: new Uint8Array([1, 2, 3]), response: new Uint8Array([4, 5]) });
  for (let length = 0; length < bytes.length - 2; ++length) assert.equal(decodeAnswer(bytes.subarray(0, length)), null);
});

class FakeSocket implements Socket {
  binaryType = '';
  bufferedAmount = 0;
  sent: Uint8Array[] = [];
  closed = false;
  onopen: (() => void) | null = null;
  onclose: (() => void) | null = null;
  onmessage: ((event: { data: unknown }) => void) | null = null;
  send(bytes: Uint8Array): void { this.sent.push(bytes); }
  close(): void { this.closed = true; this.onclose?.(); }
  answer(index: number, kind: number, response: number[] = []): void {
    const id = new DataView(this.sent[index]!.buffer).getUint32(1);
    this.onmessage?.({ data: answerBytes(kind, id, 0, '', [], response).buffer });
  }
}

/** Time that a test lets go on. */
class FakeWorld {
  time = 0;
  sockets: FakeSocket[] = [];
  private timers = new Map<number, { at: number; run: () => void }>();
  private next = 1;
  open = () => { const socket = new FakeSocket(); this.sockets.push(socket); return socket; };
  now = () => this.time;
  later = (ms: number, run: () => void) => { this.timers.set(this.next, { at: this.time + ms, run }); return this.next++; };
  cancel = (handle: unknown) => { this.timers.delete(handle as number); };
  advance(ms: number): void {
    const end = this.time + ms;
    for (;;) {
      const due = [...this.timers].filter(([, { at }]) => at <= end).sort(([, a], [, b]) => a.at - b.at)[0];
      if (due === undefined) break;
      this.timers.delete(due[0]);
      this.time = due[1].at;
      due[1].run();
    }
    this.time = end;
  }
}

function opened(): [Lane, FakeWorld, FakeSocket] {
  const world = new FakeWorld();
  const lane = new Lane(world);
  lane.start();
  const socket = world.sockets[0]!;
  socket.onopen!();
  return [lane, world, socket];
}

test('while it is closed a call fails at once: nothing waits, and so nothing arrives late', async () => {
  const world = new FakeWorld();
  const lane = new Lane(world);
  await assert.rejects(lane.call('m', new Uint8Array()), LaneClosed);
  lane.start();
  await assert.rejects(lane.call('m', new Uint8Array()), LaneClosed);
  world.sockets[0]!.onopen!();
  assert.equal(world.sockets[0]!.sent.length, 1, 'an echo, and nothing of before');
});

test('how long it takes is that of the last echo, or of the one that is awaited', () => {
  const [lane, world, socket] = opened();
  world.advance(12);
  socket.answer(0, Kind.echo);
  assert.equal(lane.takes(), 12);
  world.advance(1000);
  assert.equal(socket.sent.length, 2);
  world.advance(700);
  assert.equal(lane.takes(), 712);
});

test('the number of an echo comes back at once, and no further', () => {
  const [, world, socket] = opened();
  const number = [1, 2, 3, 4, 5, 6, 7, 8];
  world.advance(5);
  socket.answer(0, Kind.echo, number);
  assert.equal(socket.sent.length, 2);
  assert.deepEqual([...socket.sent[1]!.subarray(9)], [0, ...number]);
  assert.equal(new DataView(socket.sent[1]!.buffer).getUint32(5), 5, 'its own time');
  socket.answer(1, Kind.echo, [9, 9, 9, 9, 9, 9, 9, 9]);
  assert.equal(socket.sent.length, 2);
  world.advance(1000);
  socket.answer(2, Kind.echo, number);
  assert.equal(socket.sent.length, 4);
});

test('answers go to their calls, whatever their order', async () => {
  const [lane, , socket] = opened();
  const first = lane.call('a', new Uint8Array());
  const second = lane.call('b', new Uint8Array());
  socket.answer(2, Kind.answer);
  socket.answer(1, Kind.droppedAsLate);
  assert.equal((await first).kind, Kind.droppedAsLate);
  assert.equal((await second).kind, Kind.answer);
});

test('when it is lost, what waits fails, who asked is told, and it is opened again', async () => {
  const [lane, world, socket] = opened();
  let lost = 0;
  lane.onLost(() => { lost += 1; });
  const waiting = lane.call('a', new Uint8Array());
  socket.onclose!();
  await assert.rejects(waiting, LaneClosed);
  assert.equal(lost, 1);
  assert.equal(lane.takes(), Infinity);
  world.advance(250);
  assert.equal(world.sockets.length, 2);
  world.sockets[1]!.onopen!();
  assert.equal(lane.state.value, 'open');
});

test('stopped, it is closed and stays so', () => {
  const [lane, world, socket] = opened();
  lane.stop();
  assert.ok(socket.closed);
  world.advance(60_000);
  assert.equal(world.sockets.length, 1);
});

const { home } = AxisService.method;
const lastId = (socket: FakeSocket) => new DataView(socket.sent.at(-1)!.buffer).getUint32(1);

test('a start goes over the lane, and its answer is the response', async () => {
  const [lane, , socket] = opened();
  const waiting = byLane(lane, home, { axis: 'feeder' });
  const sent = socket.sent.at(-1)!;
  assert.equal(new TextDecoder().decode(sent.subarray(10, 10 + sent[9]!)), 'axisd.v1.AxisService/Home');
  assert.equal(fromBinary(home.input, sent.subarray(10 + sent[9]!)).axis, 'feeder');
  socket.answer(1, Kind.answer, [...toBinary(home.output, create(home.output, { command: { id: 'c-1' } }))]);
  assert.equal((await waiting).command!.id, 'c-1');
});

test('a start that was not sent, was dropped as late or was refused says so', async () => {
  await assert.rejects(byLane(new Lane(new FakeWorld()), home, { axis: 'feeder' }), /lane to the machine is closed/);
  const [lane, , socket] = opened();
  const late = byLane(lane, home, { axis: 'feeder' });
  socket.answer(1, Kind.droppedAsLate);
  await assert.rejects(late, /held up on its way/);
  const refused = byLane(lane, home, { axis: 'feeder' });
  socket.onmessage!({ data: answerBytes(Kind.refused, lastId(socket), 9, 'too many', [], []).buffer });
  await assert.rejects(refused, /too many/);
});

test('of a start on a lane that is lost nobody knows what became', async () => {
  const [lane, , socket] = opened();
  const waiting = byLane(lane, home, { axis: 'feeder' });
  socket.onclose!();
  await assert.rejects(waiting, NoAnswer);
});
