// What the page records of a motion is what the stream of states said: through the real gateway and daemon.
import assert from 'node:assert/strict';
import { createRequire } from 'node:module';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import type { Browser, Page } from 'playwright-core';
import { fromBinary } from '@bufbuild/protobuf';
import { WatchAxesResponseSchema } from '@proto/axis_service_pb';
import { LinkState, State, type AxisState } from '@proto/types_pb';
import { CHROMIUM, sleep, Stack, until } from './stack';

const { chromium } = createRequire(process.env['AXISD_WEB_MODULES']!)('playwright-core') as typeof import('playwright-core');
const AXIS = 'feeder';
/** A record begins so long before its trigger, and a trigger records for so long. */
const BEFORE_MS = 1000;
const AFTER_MS = 2000;

let stack: Stack;
let browser: Browser;

before(async () => {
  stack = new Stack();
  await stack.start();
  browser = await chromium.launch({ executablePath: CHROMIUM, args: ['--no-sandbox', '--disable-gpu'] });
});
after(async () => {
  await browser?.close().catch(() => {});
  await stack?.close();
});

interface Reading { at: number; state: AxisState }

/** Each reading of the axis that goes by on its way to the page, once. */
function readings(): Reading[] {
  const went: Reading[] = [];
  stack.network.tap = (message) => {
    const state = fromBinary(WatchAxesResponseSchema, message).axes.find(({ axis }) => axis === AXIS);
    if (state?.measuredAt === undefined || state.link !== LinkState.ONLINE) return;
    const at = Number(state.measuredAt.seconds) * 1000 + state.measuredAt.nanos / 1e6;
    if (went.length === 0 || at > went.at(-1)!.at) went.push({ at, state });
  };
  return went;
}

const isActive = ({ state }: Reading, terminal: string) => [...state.inputs, ...state.outputs].some(({ name, active }) => name === terminal && active);

/** The line of the table that belongs to a reading, but for its time. */
function line({ state }: Reading, terminals: readonly string[]): string[] {
  const number = (value: number | undefined) => (value === undefined ? '' : String(value));
  return [state.axis, state.unit, number(state.position), number(state.velocity), number(state.target), number(state.followingError),
          state.moving ? '1' : '0', State[state.state]!.toLowerCase(),
          ...terminals.map((terminal) => [...state.inputs, ...state.outputs].find(({ name }) => name === terminal)!.active ? '1' : '0')];
}

/** Milliseconds since 1970 of a time with six digits behind its seconds. */
const time = (text: string) => Date.parse(`${text.slice(0, 23)}Z`) + Number(text.slice(23, 26)) / 1000;

async function table(page: Page): Promise<{ head: string[]; rows: string[][] }> {
  const [download] = await Promise.all([page.waitForEvent('download'), page.locator('[data-act="csv"]').click()]);
  const [head, ...rows] = readFileSync((await download.path())!, 'utf8').trim().split('\r\n').map((text) => text.split(','));
  return { head: head!, rows };
}

/** Sets both cursors: what they show is what the record has there. */
async function cursorsTell(page: Page, trigger: number, recorded: readonly Reading[]): Promise<void> {
  const box = (await page.locator('.u-over').first().boundingBox())!;
  for (const share of [0.25, 0.75]) await page.mouse.click(box.x + box.width * share, box.y + box.height / 2);
  const number = (text: string) => Number(/-?\d+(\.\d+)?/.exec(text)![0]);
  const heads = await page.locator('.readings thead th').allTextContents();
  const cells = await page.locator('.readings tbody tr', { hasText: 'osition' }).first().locator('td').allTextContents();
  const shown = [0, 1].map((cursor) => {
    assert.match(heads[cursor + 1]!, new RegExp(`^${'AB'[cursor]!} `));
    const at = trigger + number(heads[cursor + 1]!) * 1000;
    // The cursor is told to the millisecond: which reading it is may be open by one.
    const near = [-0.5, 0.5].map((off) => recorded.filter((reading) => reading.at <= at + off).at(-1)!.state.position.toFixed(3));
    assert.ok(near.some((position) => cells[cursor] === `${position} mm`), `${heads[cursor + 1]}: ${cells[cursor]}, and not ${near.join(' or ')}`);
    return number(cells[cursor]!);
  });
  assert.ok(Math.abs(number(cells[2]!) - (shown[1]! - shown[0]!)) < 0.0015, cells.join(' '));
}

test('a limit switch trips in a move: trigger, one second before it, cursors, and a table equal to the stream', async () => {
  const went = readings();
  const page = await (await browser.newContext({ viewport: { width: 1440, height: 900 } })).newPage();
  await page.goto(`${stack.url}/scope/${AXIS}?panel=0&lang=en`);
  await page.locator('.trigger .choice .button', { hasText: /^Edge$/ }).click();
  await page.locator('.trigger select').selectOption('X1');
  await stack.axisctl('enable', AXIS, '--wait');
  await stack.axisctl('home', AXIS, '--wait');
  await stack.axisctl('move', AXIS, '300mm', '--velocity', '30mm/s');
  await until(async () => (await stack.truth(AXIS)).moving, 'it moves', 5000);
  await sleep(1300);
  await stack.axisctl('sim', 'input', AXIS, 'X1', 'on');
  await page.locator('.records .button', { hasText: 'edge X1' }).click();
  const { head, rows } = await table(page);

  const terminals = head.slice(9);
  assert.deepEqual(head.slice(0, 9), ['time', 'axis', 'unit', 'position', 'velocity', 'target', 'following_error', 'moving', 'state']);
  assert.ok(terminals.includes('X1'));
  const tripped = went.find((reading) => isActive(reading, 'X1'))!;
  const recorded = went.filter(({ at }) => at >= tripped.at - BEFORE_MS && at <= tripped.at + AFTER_MS);
  assert.deepEqual(rows.map(([, ...rest]) => rest), recorded.map((reading) => line(reading, terminals)));
  recorded.forEach(({ at }, index) => assert.ok(Math.abs(time(rows[index]![0]!) - at) < 0.001, `${rows[index]![0]} is not ${at}`));
  assert.ok(recorded[0]!.at < tripped.at - BEFORE_MS / 2 && recorded[0]!.state.moving, 'it was moving before');
  assert.ok(!recorded.at(-1)!.state.moving, 'it rests behind the switch');
  await cursorsTell(page, tripped.at, recorded);
});
