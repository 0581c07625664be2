import assert from 'node:assert/strict';
import { test } from 'node:test';
import { IDLE_MS, none, RENEW_MS, step, tokenOf, TTL_MS, type Effect, type Event, type State } from '../src/hold/control';

const run = (events: readonly Event[], from: State = none): [State, Effect[]] => events.reduce<[State, Effect[]]>(([state], event) => {
  const next = step(state, event);
  return [next.state, next.effects];
}, [from, []]);

const acquired: Event = { type: 'acquired', token: 7n, axes: ['feeder', 'lifter'], at: 1000 };

test('a page starts as observer', () => {
  assert.equal(tokenOf(none, 'feeder'), 0n);
  assert.deepEqual(step(none, { type: 'frame', at: 5000 }), { state: none, effects: [] });
});

test('a lease covers its axes, and is renewed while the page is painted', () => {
  const [state] = run([acquired]);
  assert.equal(tokenOf(state, 'lifter'), 7n);
  assert.equal(tokenOf(state, 'pusher'), 0n);
  assert.deepEqual(step(state, { type: 'frame', at: 1000 + RENEW_MS - 1 }).effects, []);
  assert.deepEqual(step(state, { type: 'frame', at: 1000 + RENEW_MS }).effects, [{ do: 'renew', token: 7n, sent: 1000 + RENEW_MS }]);
});

test('after a hang of longer than the lease it is over, and nothing is renewed', () => {
  const [state, effects] = run([acquired, { type: 'frame', at: 1000 + TTL_MS + 1 }]);
  assert.deepEqual(effects, [{ do: 'ended', axes: ['feeder', 'lifter'], why: 'expired' }]);
  assert.equal(tokenOf(state, 'feeder'), 0n);
});

test('what counts is when the renewal was sent, not when its answer came', () => {
  const [state] = run([acquired, { type: 'frame', at: 1700 }, { type: 'renewed', token: 7n, sent: 1700 }]);
  assert.equal(step(state, { type: 'frame', at: 1700 + TTL_MS }).state.leases.length, 1);
  assert.equal(step(state, { type: 'frame', at: 1700 + TTL_MS + 1 }).state.leases.length, 0);
});

test('another takes it', () => {
  const [state, effects] = run([acquired, { type: 'lost', token: 7n }]);
  assert.deepEqual(effects, [{ do: 'ended', axes: ['feeder', 'lifter'], why: 'taken' }]);
  assert.equal(state.leases.length, 0);
});

test('hiding the page gives it back', () => {
  const [, effects] = run([acquired, { type: 'end', why: 'hidden' }]);
  assert.deepEqual(effects, [{ do: 'release', token: 7n }, { do: 'ended', axes: ['feeder', 'lifter'], why: 'hidden' }]);
});

test('five minutes without a touch give it back; a touch counts anew', () => {
  let [state] = run([acquired]);
  for (let at = 1000; at <= 1000 + IDLE_MS; at += 500) {
    state = step(state, { type: 'frame', at }).state;
    state = step(state, { type: 'renewed', token: 7n, sent: at }).state;
  }
  assert.equal(state.leases.length, 1);
  const [touched] = run([{ type: 'touched', at: 1000 + IDLE_MS }, { type: 'frame', at: 1001 + IDLE_MS }], state);
  assert.equal(touched.leases.length, 1);
  const [over, effects] = run([{ type: 'frame', at: 1001 + IDLE_MS }], state);
  assert.equal(over.leases.length, 0);
  assert.deepEqual(effects[0], { do: 'release', token: 7n });
});

test('of several leases the one of an axis ends as a whole', () => {
  const [state] = run([acquired, { type: 'acquired', token: 8n, axes: ['pusher'], at: 1000 }, { type: 'end', why: 'released', axes: ['lifter'] }]);
  assert.equal(tokenOf(state, 'feeder'), 0n);
  assert.equal(tokenOf(state, 'pusher'), 8n);
});

test('an axis that is leased anew is under the new lease', () => {
  const [state] = run([acquired, { type: 'acquired', token: 9n, axes: ['feeder'], at: 1100 }]);
  assert.equal(tokenOf(state, 'feeder'), 9n);
  assert.equal(tokenOf(state, 'lifter'), 0n);
});
