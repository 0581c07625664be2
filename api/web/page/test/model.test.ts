import assert from 'node:assert/strict';
import { test } from 'node:test';
import { create } from '@bufbuild/protobuf';
import { ErrorDetailSchema, Reason } from '@proto/error_pb';
import { csv, isoTime } from '../src/model/csv';
import { valueAt } from '../src/model/cursor';
import { ageNow, PollMeter, ServerClock, staleAfter } from '../src/model/fresh';
import { quantile } from '../src/model/histogram';
import { ageText, keyed, shown, typed } from '../src/model/numbers';
import { moveTime } from '../src/model/profile';
import { niceSpeed, rangesOf } from '../src/model/ranges';
import { AFTER_MS, BEFORE_MS, fires, Recorder, type Record } from '../src/model/record';
import { nearest, remedyOf } from '../src/model/remedy';
import { parse, split } from '../src/route';
import { align, KEPT_MS, listed, Series, thin, type Sample } from '../src/model/series';

const sample = (at: number, change: Partial<Sample> = {}): Sample => ({
  at, position: at / 10, velocity: 0, target: NaN, error: NaN, moving: false, state: 2, terminals: 0, ...change });

test('series: keeps ten minutes, in order, and each reading once', () => {
  const series = new Series();
  for (let at = 0; at <= KEPT_MS + 60_000; at += 50) series.push(sample(at));
  assert.equal(series.push(sample(KEPT_MS + 60_000)), false);
  assert.equal(series.length, KEPT_MS / 50 + 1);
  assert.equal(series.at(0), 60_000);
  assert.equal(series.sample(series.length - 1).position, (KEPT_MS + 60_000) / 10);
  assert.equal(series.find(60_001), 1);
  assert.equal(series.find(Infinity), series.length);
  assert.deepEqual(series.span(60_000, 60_100).map(({ at }) => at), [60_000, 60_050, 60_100]);
});

test('series: what comes faster than twenty times a second takes no more room', () => {
  const series = new Series(100);
  for (let at = 0; at < 1000; ++at) series.push(sample(at, { terminals: 0xffffffff, moving: true, state: 8, target: 5 }));
  assert.equal(series.length, 100);
  assert.deepEqual(series.sample(0), sample(900, { terminals: 0xffffffff, moving: true, state: 8, target: 5 }));
});

test('thin: keeps highs and lows of each stretch', () => {
  const samples = Array.from({ length: 10_000 }, (_, at) => sample(at, { position: at === 5003 ? 99 : at === 7001 ? -99 : 0 }));
  const { at, value } = thin(listed(samples), 'position', 0, 10_000, 100);
  assert.ok(at.length <= 400 + 4);
  assert.equal(value[at.indexOf(5003)], 99);
  assert.equal(value[at.indexOf(7001)], -99);
  assert.deepEqual([...at].sort((a, b) => a - b), at);
  assert.equal(at[0], 0);
});

test('align: one time axis for all', () => {
  assert.deepEqual(align([{ at: [1, 3], value: [10, 30] }, { at: [2, 3], value: [null, 31] }]),
                   [[1, 2, 3], [10, undefined, 30], [undefined, null, 31]]);
});

test('cursor: the last sample until then', () => {
  const samples = listed([sample(10, { position: 1 }), sample(20, { position: 2, target: 7 })]);
  assert.equal(valueAt(samples, 'position', 9), null);
  assert.equal(valueAt(samples, 'position', 19.9), 1);
  assert.equal(valueAt(samples, 'position', 20), 2);
  assert.equal(valueAt(samples, 'target', 15), null);
  assert.equal(valueAt(samples, 'target', 99), 7);
});

test('triggers', () => {
  const bit = (active: boolean) => sample(1, { terminals: active ? 4 : 0 });
  assert.ok(fires({ on: 'edge', terminal: 2, name: 'X2', rising: true }, bit(false), bit(true)));
  assert.ok(!fires({ on: 'edge', terminal: 2, name: 'X2', rising: true }, bit(true), bit(true)));
  assert.ok(fires({ on: 'edge', terminal: 2, name: 'X2', rising: false }, bit(true), bit(false)));
  assert.ok(!fires({ on: 'edge', terminal: 2, name: 'X2', rising: true }, null, bit(true)));
  const level = { on: 'level', quantity: 'position', level: 5, rising: true } as const;
  assert.ok(fires(level, sample(1, { position: 4.9 }), sample(2, { position: 5 })));
  assert.ok(!fires(level, sample(1, { position: 5 }), sample(2, { position: 6 })));
  assert.ok(fires({ ...level, rising: false }, sample(1, { position: 5.1 }), sample(2, { position: 5 })));
  assert.ok(fires({ on: 'fault' }, sample(1), sample(2, { state: 8 })));
  assert.ok(!fires({ on: 'fault' }, sample(1, { state: 8 }), sample(2, { state: 8 })));
});

test('recorder: each motion, from one second before its start', () => {
  const series = new Series();
  const records: Omit<Record, 'id' | 'axis' | 'unit'>[] = [];
  const recorder = new Recorder(series, (record) => records.push(record));
  for (let at = 0; at <= 6000; at += 50) {
    const now = sample(at, { moving: at >= 2000 && at < 4000 });
    series.push(now);
    recorder.feed(now, { on: 'motion' }, '', 500);
  }
  assert.equal(records.length, 1);
  assert.equal(records[0]!.at, 2000);
  assert.equal(records[0]!.samples[0]!.at, 2000 - BEFORE_MS);
  assert.equal(records[0]!.samples.at(-1)!.at, 4000 + AFTER_MS);
});

test('recorder: a terminal in a motion is a record of its own, one second before it included', () => {
  const series = new Series();
  const records: Omit<Record, 'id' | 'axis' | 'unit'>[] = [];
  const recorder = new Recorder(series, (record) => records.push(record));
  for (let at = 0; at <= 6000; at += 50) {
    const now = sample(at, { moving: at >= 2000 && at < 4000, terminals: at >= 3000 ? 1 : 0 });
    series.push(now);
    recorder.feed(now, { on: 'edge', terminal: 0, name: 'X0', rising: true }, 'X0', 1500);
  }
  assert.deepEqual(records.map(({ why, at, detail }) => [why, at, detail]), [['motion', 2000, ''], ['edge', 3000, 'X0']]);
  assert.equal(records[1]!.samples[0]!.at, 2000);
  assert.equal(records[1]!.samples.at(-1)!.at, 4500);
});

test('CSV: every digit of the stream', () => {
  assert.equal(isoTime(1_700_000_000_123.456), '2023-11-14T22:13:20.123456Z');
  assert.equal(isoTime(1_700_000_000_999.9999), '2023-11-14T22:13:21.000000Z');
  const text = csv([{ axis: 'feeder', unit: 'mm', terminals: ['X0', 'X1'], samples: [
    sample(0, { position: 0.1 + 0.2, velocity: -1 / 3, target: 5, terminals: 2, moving: true })] },
  { axis: 'lifter', unit: 'mm', terminals: ['X1'], samples: [sample(1, { terminals: 1 })] }], (state) => `s${state}`);
  assert.equal(text, ['time,axis,unit,position,velocity,target,following_error,moving,state,X0,X1',
    '1970-01-01T00:00:00.000000Z,feeder,mm,0.30000000000000004,-0.3333333333333333,5,,1,s2,0,1',
    '1970-01-01T00:00:00.001000Z,lifter,mm,0.1,0,,,0,s2,,1', ''].join('\r\n'));
});

test('fresh: older than three polls is old', () => {
  assert.equal(staleAfter(50, 200), 600);
  assert.equal(staleAfter(100, 20), 300);
  assert.equal(staleAfter(50, null), 750);
  assert.equal(ageNow(30, 1000, 1500), 530);
  assert.equal(ageNow(30, 1000, 900), 30);
});

test('polls: as often as they were seen, at rest and in motion; a gap changes nothing', () => {
  const meter = new PollMeter();
  assert.equal(meter.period(false), null);
  for (let at = 0; at <= 2000; at += 200) meter.read(at, false);
  assert.equal(meter.period(false), 200);
  for (let at = 2050; at <= 2500; at += 50) meter.read(at, true);
  assert.equal(meter.period(true), 50);
  meter.read(9000, true);
  assert.equal(meter.period(true), 50);
  assert.equal(meter.period(false), 200);
});

test('server clock: never later than the daemon, whatever the network does', () => {
  const clock = new ServerClock();
  assert.equal(clock.at(0), null);
  let seed = 1;
  for (let now = 0; now < 100_000; now += 50) {
    seed = (seed * 16807) % 2147483647;
    const made = now + 5_000_000;
    const late = now + 3 + (seed % 200);
    clock.heard(made, late);
    assert.ok(clock.at(late)! <= late + 5_000_000);
  }
  clock.heard(9_000_000, 100_500);
  assert.equal(clock.at(100_500), 9_000_000, 'it was set');
});

test('moves take as long as their ramps and their way say', () => {
  assert.equal(moveTime(100, 50, 200, 200), 2200);
  assert.equal(moveTime(-100, 50, 200, 200), 2200);
  assert.ok(Math.abs(moveTime(2.5, 50, 200, 200)! - 200) < 1e-9, 'too short for its velocity');
  assert.equal(moveTime(1, 0, 200, 200), null);
});

test('numbers as people write them', () => {
  assert.equal(typed('1,5'), 1.5);
  assert.equal(typed(' -.5 '), -0.5);
  for (const bad of ['', '-', '1e3', 'NaN', '1.2.3', '0x1']) assert.equal(typed(bad), null);
  assert.equal(shown(-0.0001, 2), '0.00');
  assert.equal(shown(Infinity, 2), '-');
  assert.equal(['1', '2', '.', '5', '.', 'sign', 'back'].reduce(keyed, ''), '-12.');
  assert.equal(keyed('12', 'clear'), '');
  assert.deepEqual([900, 12_000, 180_000, 7_200_000].map(ageText), ['0.9 s', '12 s', '3 min', '2 h']);
});

test('speeds to jog at are round', () => {
  assert.deepEqual([100, 99, 50, 49, 3.2, 0.7].map(niceSpeed), [100, 50, 50, 20, 2, 0.5]);
});

test('remedies: what a reason leads to', () => {
  const detail = (reason: Reason, permitted?: { minimum: number; maximum: number; unit: string }) =>
    create(ErrorDetailSchema, { reason, ...(permitted ? { permitted } : {}) });
  assert.deepEqual(remedyOf(detail(Reason.NOT_TRUSTED), {}), { act: 'home' });
  assert.deepEqual(remedyOf(detail(Reason.LEASE_REQUIRED), {}), { act: 'take-control' });
  assert.deepEqual(remedyOf(detail(Reason.STOPPING), {}), null, 'time does it');
  assert.deepEqual(remedyOf(detail(Reason.STOPPING), { held: true }), { act: 'release-hold' });
  assert.deepEqual(remedyOf(detail(Reason.SOFT_LIMIT, { minimum: 0, maximum: 400, unit: 'mm' }), { position: 500 }), { act: 'use', field: 'position', value: 400 });
  assert.deepEqual(remedyOf(detail(Reason.OUT_OF_RANGE, { minimum: 1, maximum: 90, unit: 'mm/s' }), { position: 5, velocity: 200 }), { act: 'use', field: 'velocity', value: 90 });
  assert.equal(remedyOf(detail(Reason.OUT_OF_RANGE, { minimum: 1, maximum: 90, unit: 'ms' }), { position: 5 }), null);
  const limits = detail(Reason.SOFT_LIMIT, { minimum: 0, maximum: 150, unit: 'mm' });
  assert.deepEqual(remedyOf(limits, { position: 400, base: 99.996 }), { act: 'use', field: 'position', value: 50 }, 'a distance ends within the limits');
  assert.deepEqual(remedyOf(limits, { position: -400, base: 99.996 }), { act: 'use', field: 'position', value: -99.99 });
});

test('the nearest value that is permitted is permitted when it is written with few digits', () => {
  assert.equal(nearest(0, 1 / 3, 2 / 3), 0.3334);
  assert.equal(nearest(9, 1 / 3, 2 / 3), 0.6666);
  assert.equal(nearest(0.5, 1 / 3, 2 / 3), 0.5);
});

test('ranges are read from what stands in the way', () => {
  const ranges = rangesOf([create(ErrorDetailSchema, { reason: Reason.DISABLED }),
    create(ErrorDetailSchema, { reason: Reason.OUT_OF_RANGE, permitted: { minimum: 0.5, maximum: 100, unit: 'mm/s' } }),
    create(ErrorDetailSchema, { reason: Reason.SOFT_LIMIT, permitted: { minimum: 0, maximum: 400, unit: 'mm' } })], 'mm');
  assert.deepEqual(ranges, { position: [0, 400], velocity: [0.5, 100] });
});

test('addresses: the machine, and what is shown of it', () => {
  assert.deepEqual(split('/axis/feeder'), { machine: '', path: '/axis/feeder' });
  assert.deepEqual(split('/@press-1/axis/feeder'), { machine: 'press-1', path: '/axis/feeder' });
  assert.deepEqual(split('/@press-1'), { machine: 'press-1', path: '/' });
  assert.deepEqual(split('/@Press 1/axis'), { machine: '', path: '/@Press 1/axis' }, 'no name of a machine');
  assert.deepEqual(parse(split('/@press-1/axis/feeder').path), { screen: 'axis', of: 'feeder' });
});

test('histograms', () => {
  assert.equal(quantile([], 0.5), null);
  assert.equal(quantile([1n, 0n, 0n, 0n, 3n], 0.5), 0.2);
});
