// What the page costs a stop, how old its values are on a slow computer, and whether its memory stays what it was.
//   node tests/bench/page_bench.mjs BUILD [stop|all|slow|pages|bad|heap [NUMBER [TIMES]]]
// NUMBER: stops of each kind, of heap minutes, of bad one of its kinds; TIMES: as fast goes the time of the page, before a machine that is made up
import { createRequire } from 'node:module';
import { once } from 'node:events';
import { Worker } from 'node:worker_threads';
import type { Browser, CDPSession, Page } from 'playwright-core';
import { fromBinary } from '@bufbuild/protobuf';
import { WatchAxesResponseSchema } from '@proto/axis_service_pb';
import { CHROMIUM, manyAxes, sleep, Stack, until } from '../real/stack';
import { badInput } from './bad';
import { hurry, type Haste } from './haste';
import { costOfPages } from './pages';

const { chromium } = createRequire(process.env['AXISD_WEB_MODULES']!)('playwright-core') as typeof import('playwright-core');

const SCREENS = ['machine', 'axis/turntable', 'scope', 'groups', 'terminals', 'buses', 'events', 'people'];
const HEAP_AXES = 16;
const [what = '', number = '', times = ''] = process.argv.slice(2);
const ROUNDS = Number(number || '30');

interface Running { stack: Stack; browser: Browser }

async function running(axes: number | null, measure: (running: Running) => Promise<void>): Promise<void> {
  const stack = new Stack();
  await stack.start(axes === null ? undefined : manyAxes(axes));
  const browser = await chromium.launch({ executablePath: CHROMIUM, args: ['--no-sandbox', '--disable-gpu'] });
  try { await measure({ stack, browser }); } finally {
    await browser.close();
    await stack.close();
  }
}

/** A window of its own, in a browser's profile of its own: six connections each. */
async function open({ stack, browser }: Running, screen: string): Promise<Page> {
  const context = await browser.newContext({ viewport: { width: 1440, height: 900 } });
  const page = await context.newPage();
  await page.goto(`${stack.url}/${screen}?panel=0&lang=en`);
  await until(async () => await page.locator('header .fact.warn').count() === 0 && await page.locator('.banner.alarm').count() === 0, `${screen} is live`, 20_000);
  return page;
}

const sorted = (values: number[]) => [...values].sort((a, b) => a - b);
const quantile = (values: number[], share: number) => sorted(values)[Math.min(values.length - 1, Math.floor(values.length * share))]!;
const figures = (what: string, values: number[], unit: string) =>
  console.log(`${what}: median ${quantile(values, 0.5).toFixed(1)}, 95 % ${quantile(values, 0.95).toFixed(1)}, longest ${Math.max(...values).toFixed(1)} ${unit} (${values.length})`);

/** When the newest stops of each axis were accepted, by the computer's clock in ms. */
async function acceptedAt(stack: Stack, kinds: RegExp, count: number): Promise<number[]> {
  const { commands } = JSON.parse(await stack.axisctl('command', 'list', '--limit', '500', '--json')) as { commands: { kind: string; accepted_at: string }[] };
  return commands.filter(({ kind }) => kinds.test(kind)).slice(0, count).map(({ accepted_at: at }) => Date.parse(at) + Number(`0.${/\.\d{3}(\d+)Z/.exec(at)?.[1] ?? '0'}`));
}

const wallClock = () => performance.timeOrigin + performance.now();

/** Presses a stop in the page; when the finger went down, by the computer's clock. */
const press = (page: Page, stop: string) => page.evaluate((which) => {
  const button = document.querySelector(`.stops [data-stop="${which}"]`)!;
  const at = performance.timeOrigin + performance.now();
  button.dispatchEvent(new PointerEvent('pointerdown', { button: 0, bubbles: true, cancelable: true }));
  return at;
}, stop);

/** From the finger, or the start of the program, to when the daemon has accepted the last of the stops. */
async function stops({ stack }: Running, page: Page, stop: string, axes: number, words: string[]): Promise<void> {
  const byPage: number[] = [];
  const byCommand: number[] = [];
  for (let round = 0; round < ROUNDS; ++round) {
    for (const [times, run] of [[byPage, async () => press(page, stop)],
                                [byCommand, async () => { const at = wallClock(); await stack.axisctl(...words); return at; }]] as const) {
      const at = await run();
      let accepted: number[] = [];
      await until(async () => {
        accepted = (await acceptedAt(stack, /STOP$/, axes)).filter((when) => when > at - 1);
        return accepted.length === axes;
      }, 'the stops are accepted', 10_000);
      times.push(Math.max(...accepted) - at);
      await sleep(200);
      if (stop === 'all') await stack.axisctl('release-stop', '--all');
    }
  }
  figures(`${words.join(' ')} by the page`, byPage, 'ms');
  figures(`${words.join(' ')} by axisctl, with its start`, byCommand, 'ms');
}

async function stopOfEight(): Promise<void> {
  await running(null, async (all) => {
    const pages: Page[] = [];
    for (const screen of SCREENS) pages.push(await open(all, screen));
    await stops(all, pages[1]!, 'turntable', 1, ['stop', 'turntable']);
  });
}

async function stopOfAll(): Promise<void> {
  await running(120, async (all) => {
    const page = await open(all, 'machine');
    await until(async () => await page.locator('tr[data-axis]').count() === 120, '120 rows', 20_000);
    await stops(all, page, 'all', 120, ['stop', '--all']);
  });
}

/** How many batches have gone by since the one that a page shows, at each of its frames, and how old that one is. */
async function slow(): Promise<void> {
  await running(64, async (all) => {
    const page = await open(all, 'machine');
    const axis = 'axis-7';
    const went: { at: number; text: string }[] = [];
    all.stack.network.tap = (message) => {
      const state = fromBinary(WatchAxesResponseSchema, message).axes.find((one) => one.axis === axis);
      if (state !== undefined) went.push({ at: wallClock(), text: state.position.toFixed(2) });
    };
    await all.stack.axisctl('enable', axis, '--wait');
    await all.stack.axisctl('velocity', axis, '40deg/s');
    const cdp = await page.context().newCDPSession(page);
    for (const rate of [1, 4]) {
      await cdp.send('Emulation.setCPUThrottlingRate', { rate });
      await sleep(1000);
      went.length = 0;
      const shown = await page.evaluate(async (name) => {
        const cell = document.querySelector(`tr[data-axis="${name}"] .position b`)!;
        const seen: { at: number; text: string }[] = [];
        const end = performance.now() + 10_000;
        while (performance.now() < end) {
          await new Promise((resolve) => requestAnimationFrame(resolve));
          seen.push({ at: performance.timeOrigin + performance.now(), text: cell.textContent! });
        }
        return seen;
      }, axis);
      const behind: number[] = [];
      const ages: number[] = [];
      for (const { at, text } of shown) {
        const position = /-?\d+\.\d+/.exec(text.replace(/[\u202f\u2009, ]/g, ''))?.[0] ?? '';
        const past = went.filter((batch) => batch.at <= at);
        const last = past.map((batch) => batch.text).lastIndexOf(position);
        if (last < 0) continue;  // of before
        behind.push(past.length - 1 - last);
        ages.push(at - past[last]!.at);
      }
      if (behind.length < shown.length / 2) throw new Error(`of ${shown.length} frames ${behind.length} showed a known value, as ${shown.at(-1)?.text}; went ${went.at(-1)?.text}`);
      figures(`CPU ${rate}x slower, 64 axes: batches behind`, behind, 'ticks');
      figures(`CPU ${rate}x slower, 64 axes: time since the shown batch went by`, ages, 'ms');
    }
  });
}

/** What the page keeps, minute by minute of its own time. `more`: what else is told. */
async function keeps(page: Page, minutes: number, every: number, haste: number, more: () => Promise<string>): Promise<void> {
  const cdp: CDPSession = await page.context().newCDPSession(page);
  await cdp.send('Performance.enable');
  for (let minute = 0; minute <= minutes; minute += every) {
    await cdp.send('HeapProfiler.collectGarbage');
    const { metrics } = await cdp.send('Performance.getMetrics');
    const value = (name: string) => metrics.find((one) => one.name === name)!.value;
    console.log(`${minute} min: heap ${(value('JSHeapUsedSize') / 1e6).toFixed(2)} MB, ${value('Nodes')} nodes, ${value('JSEventListeners')} listeners${await more()}`);
    if (minute < minutes) await sleep((every * 60_000) / haste);
  }
}

async function heap(minutes: number): Promise<void> {
  await running(HEAP_AXES, async (all) => keeps(await open(all, 'machine'), minutes, 1, 1, async () => ''));
}

/** The same in less time: clock and timers of the page, and of a machine that is made up, go `haste` times as fast. */
async function heapInHaste(minutes: number, haste: number): Promise<void> {
  const pace: Haste = { times: haste, from: Date.now() };
  const machine = new Worker(new URL('./hasty_machine.mjs', import.meta.url),
                             { workerData: { page: process.env['AXISD_WEB_PAGE'], axes: HEAP_AXES, haste: pace } });
  const [url] = await once(machine, 'message') as [string];
  const batches = async () => {
    machine.postMessage(null);
    return (await once(machine, 'message') as [number])[0];
  };
  const browser = await chromium.launch({ executablePath: CHROMIUM, args: ['--no-sandbox', '--disable-gpu'] });
  try {
    const page = await (await browser.newContext({ viewport: { width: 1440, height: 900 } })).newPage();
    await page.addInitScript(hurry, pace);
    await page.goto(`${url}/machine?panel=0&lang=en`);
    await until(async () => await page.locator('tr[data-axis]').count() === HEAP_AXES && await page.locator('.banner.alarm').count() === 0, 'it is live', 20_000);
    const shown = () => page.locator('tr[data-axis="axis-7"] .position b').textContent();
    await keeps(page, minutes, 10, haste, async () => `, ${await batches()} batches, axis-7 at ${await shown()}`);
  } finally {
    await browser.close();
    await machine.terminate();
  }
}

if (what === '' || what === 'stop') await stopOfEight();
if (what === '' || what === 'all') await stopOfAll();
if (what === '' || what === 'slow') await slow();
if (what === '' || what === 'pages') await costOfPages();
if (what === '' || what === 'bad') await badInput(number);
if (what === 'heap') await (times === '' ? heap(Number(number || '20')) : heapInHaste(Number(number), Number(times)));
