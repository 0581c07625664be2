// Many windows at once, and a page that has more to draw than it can. How soon is measured elsewhere (tests/bench).
import assert from 'node:assert/strict';
import { createRequire } from 'node:module';
import { after, afterEach, before, test } from 'node:test';
import type { Browser, Page } from 'playwright-core';
import { CHROMIUM, manyAxes, Stack, until } from './stack';

const { chromium } = createRequire(process.env['AXISD_WEB_MODULES']!)('playwright-core') as typeof import('playwright-core');
const AXES = 120;

let demo: Stack;
let many: Stack;
let browser: Browser;

before(async () => {
  browser = await chromium.launch({ executablePath: CHROMIUM, args: ['--no-sandbox', '--disable-gpu'] });
});
after(async () => {
  await browser?.close().catch(() => {});
  await demo?.close();
  await many?.close();
});
afterEach(async () => { for (const context of browser.contexts()) await context.close().catch(() => {}); });

async function open(stack: Stack, path: string): Promise<Page> {
  const context = await browser.newContext({ viewport: { width: 1440, height: 900 } });
  const page = await context.newPage();
  await page.goto(`${stack.url}/${path}?panel=0&lang=en`);
  await live(page, path);
  return page;
}

const live = (page: Page, what: string) => until(
  async () => await page.locator('.fact').first().count() > 0 && await page.locator('.banner.alarm, .fact.warn').count() === 0, `${what} is live`, 30_000);
const press = (page: Page, stop: string) => page.evaluate((which) => {
  document.querySelector(`.stops [data-stop="${which}"]`)!.dispatchEvent(new PointerEvent('pointerdown', { button: 0, bubbles: true, cancelable: true }));
}, stop);

test('eight windows with every screen: the stop of one stops, and all of them know', async () => {
  demo = new Stack();
  await demo.start();
  const pages: Page[] = [];
  for (const screen of ['machine', 'axis/turntable', 'scope', 'groups', 'terminals', 'buses', 'events', 'people']) pages.push(await open(demo, screen));
  await demo.axisctl('enable', 'turntable', '--wait');
  await demo.axisctl('velocity', 'turntable', '20deg/s');
  await until(async () => (await demo.truth('turntable')).moving, 'it moves', 5000);
  await press(pages[1]!, 'turntable');
  await until(async () => !(await demo.truth('turntable')).moving, 'it rests', 10_000);
  await press(pages[7]!, 'all');
  for (const page of pages) await page.locator('.banner.warning', { hasText: 'STOP ALL' }).waitFor();
  await until(async () => await pages[7]!.locator('.report .outcomes li').count() === 6, 'six outcomes', 10_000);
  for (const page of pages) await live(page, page.url());
});

test('120 axes, on a computer that is four times slower: STOP ALL is for each, and what is shown is what is', async () => {
  many = new Stack();
  await many.start(manyAxes(AXES));
  const page = await open(many, 'machine');
  await until(async () => await page.locator('tr[data-axis]').count() === AXES, 'every row is there', 30_000);
  await many.axisctl('enable', 'axis-7', '--wait');
  await many.axisctl('velocity', 'axis-7', '20deg/s');
  const cdp = await page.context().newCDPSession(page);
  await cdp.send('Emulation.setCPUThrottlingRate', { rate: 4 });
  const shown = async () => Number(/-?\d+\.\d+/.exec((await page.locator('tr[data-axis="axis-7"] .position b').textContent())!)![0]);
  const first = await shown();
  await until(async () => await shown() > first + 5, 'the position goes on', 30_000);
  await press(page, 'all');
  await until(async () => !(await many.truth('axis-7')).moving, 'it rests', 10_000);
  await until(async () => await page.locator('.report .outcomes li').count() === AXES, 'an outcome of each axis', 30_000);
  assert.equal(await page.locator('.report .outcomes li.alarm').count(), 0);
  const { position } = await many.truth('axis-7');
  await until(async () => Math.abs(await shown() - position) < 0.1, 'what is shown is where it is', 30_000);
});
