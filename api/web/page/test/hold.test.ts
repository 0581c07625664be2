// Hold to run, arrow by arrow: every state with every event.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { idle, LANE_MS, PAINTED_MS, PRESS_MS, RENEW_MS, step, type Event, type Loss, type Source, type State } from '../src/hold/machine';

const finger: Source = { by: 'pointer', id: 7 };
const other: Source = { by: 'pointer', id: 8 };
const key: Source = { by: 'key', code: 'ArrowRight' };
const left: Source = { by: 'key', code: 'ArrowLeft' };

const press = (change: Partial<Event & { type: 'press' }> = {}): Event => ({
  type: 'press', at: 1000, made: 995, source: finger, alone: true, press: 'p1', velocity: 10, lane: 3, blocked: null, ...change });

function held(source: Source = finger): State & { at: 'held' } {
  const { state } = step(idle, press({ source }));
  assert.equal(state.at, 'held');
  return state as State & { at: 'held' };
}

function lost(loss: Loss = 'blur', source: Source = finger): State {
  const { state } = step(held(source), { type: 'loss', loss });
  assert.deepEqual(state, { at: 'lost', source, loss });
  return state;
}

const losses: Loss[] = ['pointer-cancel', 'lost-capture', 'blur', 'hidden', 'page-hide', 'second-pointer', 'context-menu', 'lane-lost',
                        'control-lost', 'not-live'];

test('idle, press: captures the pointer and jogs once', () => {
  const { state, effects } = step(idle, press());
  assert.deepEqual(effects, [{ do: 'capture', pointer: 7 }, { do: 'jog', press: 'p1', velocity: 10, sent: 1000 }]);
  assert.deepEqual(state, { at: 'held', source: finger, press: 'p1', velocity: 10, painted: 1000, renewed: 1000, unanswered: [1000], started: false });
});

test('idle, press by key: jogs without a pointer', () => {
  assert.deepEqual(step(idle, press({ source: key })).effects, [{ do: 'jog', press: 'p1', velocity: 10, sent: 1000 }]);
});

test('idle, press that is blocked: says why, sends nothing', () => {
  const { state, effects } = step(idle, press({ blocked: 'not-possible' }));
  assert.deepEqual(state, { at: 'lost', source: finger, loss: 'not-possible' });
  assert.deepEqual(effects, [{ do: 'say', loss: 'not-possible' }]);
});

test('idle, press that was made while the page hung: nobody may be holding any more', () => {
  const { state, effects } = step(idle, press({ made: 1000 - PRESS_MS - 1 }));
  assert.equal(state.at, 'lost');
  assert.deepEqual(effects, [{ do: 'say', loss: 'late-press' }]);
  assert.equal(step(idle, press({ made: 1000 - PRESS_MS })).state.at, 'held');
});

test('idle, press while the lane is slow or closed: refused with the reason', () => {
  for (const lane of [LANE_MS + 1, Infinity, NaN]) {
    const { state, effects } = step(idle, press({ lane }));
    assert.equal(state.at, 'lost');
    assert.deepEqual(effects, [{ do: 'say', loss: 'lane-slow' }]);
  }
  assert.equal(step(idle, press({ lane: LANE_MS })).state.at, 'held');
});

test('idle: frames, releases, losses and answers do nothing', () => {
  const events: Event[] = [{ type: 'frame', at: 2000 }, { type: 'release', source: finger }, { type: 'loss', loss: 'blur' },
                           { type: 'answer', press: 'p0', sent: 1, outcome: 'ok' }, { type: 'answer', press: 'p0', sent: 1, outcome: 'refused' }];
  for (const event of events) assert.deepEqual(step(idle, event), { state: idle, effects: [] });
});

test('held, frame: renews after 80 ms, with the id of the press', () => {
  const early = step(held(), { type: 'frame', at: 1000 + RENEW_MS - 1 });
  assert.deepEqual(early.effects, []);
  const due = step(early.state, { type: 'frame', at: 1000 + RENEW_MS });
  assert.deepEqual(due.effects, [{ do: 'jog', press: 'p1', velocity: 10, sent: 1080 }]);
  assert.deepEqual((due.state as State & { at: 'held' }).unanswered, [1000, 1080]);
});

test('held, frame of a page that was not painted in the last 100 ms: halts, and renews nothing', () => {
  const { state, effects } = step(held(), { type: 'frame', at: 1000 + PAINTED_MS + 1 });
  assert.deepEqual(state, { at: 'lost', source: finger, loss: 'not-painted' });
  assert.deepEqual(effects, [{ do: 'halt' }, { do: 'say', loss: 'not-painted' }]);
  assert.equal(step(held(), { type: 'frame', at: 1000 + PAINTED_MS }).state.at, 'held');
});

test('held, frame while an answer is awaited for longer than 300 ms: halts', () => {
  let state: State = held();
  let effects;
  for (let at = 1016; state.at === 'held'; at += 16) ({ state, effects } = step(state, { type: 'frame', at }));
  assert.deepEqual(state, { at: 'lost', source: finger, loss: 'lane-slow' });
  assert.deepEqual(effects, [{ do: 'halt' }, { do: 'say', loss: 'lane-slow' }]);
});

test('held, answers in time: goes on for as long as it is held', () => {
  let state: State = held();
  state = step(state, { type: 'answer', press: 'p1', sent: 1000, outcome: 'ok' }).state;
  let jogs = 0;
  for (let at = 1016; at < 11_000; at += 16) {
    const next = step(state, { type: 'frame', at });
    state = next.state;
    for (const effect of next.effects) {
      assert.equal(effect.do, 'jog');
      jogs += 1;
      state = step(state, { type: 'answer', press: 'p1', sent: at, outcome: 'ok' }).state;
    }
  }
  assert.equal(state.at, 'held');
  assert.equal(jogs, Math.floor(9984 / 80));
});

test('held, release: halts, and a new press jogs again with an id of its own', () => {
  const { state, effects } = step(held(), { type: 'release', source: finger });
  assert.deepEqual([state, effects], [idle, [{ do: 'halt' }]]);
  assert.deepEqual(step(state, press({ press: 'p2' })).effects.at(-1), { do: 'jog', press: 'p2', velocity: 10, sent: 1000 });
});

test('held, release of something else: goes on', () => {
  const state = held();
  for (const source of [other, key]) assert.deepEqual(step(state, { type: 'release', source }), { state, effects: [] });
  assert.deepEqual(step(held(key), { type: 'release', source: left }).effects, []);
});

test('held, each loss: halts at once, and the button has to be let go first', () => {
  for (const loss of losses) {
    const { state, effects } = step(held(), { type: 'loss', loss });
    assert.deepEqual(state, { at: 'lost', source: finger, loss });
    assert.deepEqual(effects, [{ do: 'halt' }, { do: 'say', loss }]);
  }
});

test('held, press of a second finger or key: halts', () => {
  for (const source of [other, key]) {
    const { state, effects } = step(held(), press({ source, alone: false, press: 'p2' }));
    assert.deepEqual(state, { at: 'lost', source: finger, loss: 'second-pointer' });
    assert.deepEqual(effects, [{ do: 'halt' }, { do: 'say', loss: 'second-pointer' }]);
  }
});

test('held, the press is refused or was dropped: nothing began, nothing to halt', () => {
  for (const outcome of ['refused', 'dropped'] as const) {
    const { state, effects } = step(held(), { type: 'answer', press: 'p1', sent: 1000, outcome });
    assert.deepEqual(state, { at: 'lost', source: finger, loss: outcome });
    assert.deepEqual(effects, [{ do: 'say', loss: outcome }]);
  }
});

test('held, a renewal is refused or was dropped: halts', () => {
  const { state } = step(held(), { type: 'answer', press: 'p1', sent: 1000, outcome: 'ok' });
  for (const outcome of ['refused', 'dropped'] as const) {
    assert.deepEqual(step(state, { type: 'answer', press: 'p1', sent: 1080, outcome }).effects, [{ do: 'halt' }, { do: 'say', loss: outcome }]);
  }
});

test('held, an answer to an earlier press: nothing', () => {
  const state = held();
  assert.deepEqual(step(state, { type: 'answer', press: 'p0', sent: 1, outcome: 'refused' }), { state, effects: [] });
});

test('lost: nothing moves before the button was let go', () => {
  const state = lost('not-painted');
  const events: Event[] = [{ type: 'frame', at: 2000 }, { type: 'loss', loss: 'blur' }, { type: 'answer', press: 'p1', sent: 1000, outcome: 'ok' },
                           { type: 'release', source: other }, press({ source: other, alone: false }), press({ source: key })];
  for (const event of events) assert.deepEqual(step(state, event), { state, effects: [] });
  assert.deepEqual(step(state, { type: 'release', source: finger }), { state: idle, effects: [] });
});

test('lost by a touch that was cancelled: what goes down alone was let go, though nobody heard it', () => {
  assert.equal(step(lost('pointer-cancel'), press({ source: other })).state.at, 'held');
});

test('lost with a key: the same key goes down only if it was let go; another one does not tell', () => {
  assert.equal(step(lost('not-painted', key), press({ source: key })).state.at, 'held');
  assert.equal(step(lost('not-painted', key), press({ source: left })).state.at, 'lost');
  assert.equal(step(lost('not-painted', key), press({ source: finger })).state.at, 'lost');
});

test('lost while another window had the focus: releases go unheard, so any press begins anew', () => {
  for (const loss of ['blur', 'hidden', 'page-hide'] as const) {
    assert.equal(step(lost(loss, key), press({ source: left })).state.at, 'held');
    assert.equal(step(lost(loss, key), press({ source: finger })).state.at, 'held');
  }
});

test('whatever happens in whatever order: only a press jogs anew, and what is not held sends nothing', () => {
  // A fixed sequence of numbers stands for what people, browsers and networks do.
  let seed = 12345;
  const random = (most: number) => { seed = (seed * 1103515245 + 12345) & 0x7fffffff; return (seed >> 8) % most; };
  let state: State = idle;
  let at = 0;
  let presses = 0;
  for (let round = 0; round < 200_000; ++round) {
    at += random(60);
    const sources = [finger, other, key, left];
    const source = sources[random(4)]!;
    const events: Event[] = [
      press({ at, made: at - random(130), source, alone: random(2) === 0, press: `p${presses}`, lane: random(400) }),
      { type: 'frame', at }, { type: 'frame', at }, { type: 'frame', at }, { type: 'release', source }, { type: 'loss', loss: losses[random(losses.length)]! },
      { type: 'answer', press: `p${presses}`, sent: state.at === 'held' ? state.unanswered[0] ?? 0 : 0, outcome: random(9) === 0 ? 'refused' : 'ok' }];
    const event = events[random(events.length)]!;
    const before = state;
    const next = step(before, event);
    state = next.state;
    for (const effect of next.effects) {
      if (effect.do !== 'jog') continue;
      assert.equal(state.at, 'held');
      if (event.type === 'press') { assert.notEqual(before.at, 'held'); presses += 1; }
      else assert.ok(event.type === 'frame' && before.at === 'held' && at - before.painted <= PAINTED_MS);
    }
    // Whatever was begun is halted when it is no longer held, unless it never began.
    if (before.at === 'held' && state.at !== 'held') {
      const halts = next.effects.some((effect) => effect.do === 'halt');
      assert.ok(halts || (event.type === 'answer' && !before.started));
    }
  }
  assert.ok(presses > 100);
});
