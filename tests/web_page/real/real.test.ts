// Hold to run through a real gateway and a real daemon, judged by where the simulated load really is. Whatever happens to the
// page, its browser, its network or the programs behind it while somebody holds the button: the axis stops, and never moves
// afterwards.
import assert from 'node:assert/strict';
import { createRequire } from 'node:module';
import { after, afterEach, before, test } from 'node:test';
import type { Browser, BrowserServer, Page } from 'playwright-core';
import { AXIS, Hold } from './hold';
import { CHROMIUM, sleep, Stack, until } from './stack';

const { chromium } = createRequire(process.env['AXISD_WEB_MODULES']!)('playwright-core') as typeof import('playwright-core');
/** From the last renewal to the halt. */
const HOLD_MS = 300;
const LATE_MS = 50;
/** Sanitizers and a busy computer take their time. */
const SLACK_MS = process.env['AXISD_SANITIZE'] ? 1500 : 150;

let stack: Stack;
let hold: Hold;
let server: BrowserServer;
let browser: Browser;

async function startBrowser(): Promise<void> {
  server = await chromium.launchServer({ executablePath: CHROMIUM, args: ['--no-sandbox', '--disable-gpu'] });
  browser = await chromium.connect(server.wsEndpoint());
}

before(async () => {
  stack = new Stack();
  hold = new Hold(stack);
  await stack.start();
  await startBrowser();
});
after(async () => {
  await browser?.close().catch(() => {});
  await server?.close().catch(() => {});
  await stack?.close();
});
afterEach(async () => { for (const context of browser.contexts()) await context.close().catch(() => {}); });

const held = (touch = false) => hold.held(browser, touch);
const pressed = (touch = false) => hold.pressed(browser, touch);
const restsForGood = (atMost: number) => hold.restsForGood(atMost);

/** By the time of the last renewal that went through the network, and the daemon's of the halt. */
async function haltsAfterLastRenewal(): Promise<void> {
  await until(async () => !(await stack.truth(AXIS)).moving, 'it rests', 5000);
  const { commands } = JSON.parse(await stack.axisctl('command', 'list', '--json')) as { commands: { axis: string; kind: string; ended_at: string }[] };
  const jog = commands.find(({ axis, kind }) => axis === AXIS && kind === 'COMMAND_KIND_JOG')!;
  const took = Date.parse(jog.ended_at) - performance.timeOrigin - stack.network.lastOf('/Jog');
  console.log(`# from the last renewal to the halt: ${took.toFixed(0)} ms`);
  assert.ok(took <= HOLD_MS + LATE_MS + SLACK_MS, `${took.toFixed(0)} ms`);
  await restsForGood(100);
}

async function setVisibility(page: Page, state: string): Promise<void> {
  await page.evaluate((now) => {
    Object.defineProperty(document, 'visibilityState', { configurable: true, get: () => now });
    document.dispatchEvent(new Event('visibilitychange'));
  }, state);
}

test('press and release', async () => {
  const { page } = await pressed();
  await page.mouse.up();
  await restsForGood(1000);
});

test('the page hangs for 3 s', async () => {
  const { page } = await pressed();
  const hang = page.evaluate(() => { const end = performance.now() + 3000; while (performance.now() < end); });
  await haltsAfterLastRenewal();
  await hang;
  assert.equal(await page.locator('.jog-pad').getAttribute('data-hold'), 'lost');
  await restsForGood(100);
  await page.mouse.up();
});

test('the tab is hidden', async () => {
  const { page } = await pressed();
  await setVisibility(page, 'hidden');
  await haltsAfterLastRenewal();
  await setVisibility(page, 'visible');
  await restsForGood(100);
});

test('the tab is frozen', async () => {
  // A browser freezes what is hidden. What it calls frozen while it is shown may go on being painted, and is in use then.
  const { page, cdp } = await pressed();
  await setVisibility(page, 'hidden');
  await cdp.send('Page.setWebLifecycleState', { state: 'frozen' });
  await haltsAfterLastRenewal();
  await cdp.send('Page.setWebLifecycleState', { state: 'active' });
  await setVisibility(page, 'visible');
  await restsForGood(100);
});

test('the tab is closed', async () => {
  const { page } = await pressed();
  await page.close();
  await haltsAfterLastRenewal();
});

test('the page is reloaded', async () => {
  const { page } = await pressed();
  await page.reload();
  await haltsAfterLastRenewal();
});

test('the browser is killed', async () => {
  await pressed();
  server.process().kill('SIGKILL');
  await haltsAfterLastRenewal();
  await startBrowser();
});

test('the gateway is killed', async () => {
  const { page } = await pressed();
  await stack.killGateway();
  await haltsAfterLastRenewal();
  await stack.startGateway();
  // Without a reload it is live again.
  await until(async () => await page.locator('.banner.alarm').count() === 0, 'the page is live again', 15_000);
  await restsForGood(100);
});

test('the gateway is stopped and continued', async () => {
  await pressed();
  stack.signalGateway('SIGSTOP');
  await restsForGood(1500);
  stack.signalGateway('SIGCONT');
  await restsForGood(100);
});

test('the daemon is killed, and starts again: nothing moves by itself', async () => {
  const { page } = await pressed();
  await stack.killDaemon();
  await until(async () => await page.locator('.banner.alarm').count() === 1, 'the page says that nothing is live', 5000);
  stack.startDaemon();
  await stack.answers();
  await until(async () => await page.locator('.banner.alarm').count() === 0, 'the page is live again', 15_000);
  await restsForGood(100);
  // Nobody knows what became of the jog, and its simulated drive was off while the daemon was away.
  await stack.axisctl('reset', AXIS, '--wait');
  await stack.axisctl('enable', AXIS, '--wait');
});

test('the network is cut in the hold', async () => {
  const { page } = await pressed();
  stack.network.cut();
  await haltsAfterLastRenewal();
  await page.mouse.up();
  stack.network.join();
  await restsForGood(1000);
});

test('the network is cut in the press: what comes late moves nothing', async () => {
  const { page, at } = await held();
  const before = await stack.truth(AXIS);
  stack.network.cut();
  await page.mouse.move(at.x, at.y);
  await page.mouse.down();
  await sleep(400);
  await page.mouse.up();
  await sleep(2100);
  stack.network.join();
  const { rest } = await restsForGood(100);
  assert.equal(rest.starts, before.starts, 'it was started by a press that came late');
});

test('the network is cut at the release', async () => {
  const { page } = await pressed();
  stack.network.cut();
  await page.mouse.up();
  await haltsAfterLastRenewal();
  stack.network.join();
  await restsForGood(1000);
});

test('a second finger', async () => {
  const { cdp, at } = await pressed(true);
  await cdp.send('Input.dispatchTouchEvent', { type: 'touchStart', touchPoints: [{ ...at, id: 1 }, { x: 700, y: 600, id: 2 }] });
  await restsForGood(1000);
  await cdp.send('Input.dispatchTouchEvent', { type: 'touchEnd', touchPoints: [] });
  await restsForGood(100);
});

test('the window loses the focus', async () => {
  const { page } = await pressed();
  await page.evaluate(() => window.dispatchEvent(new Event('blur')));
  await restsForGood(1000);
});

test('the touch is cancelled', async () => {
  const { cdp } = await pressed(true);
  await cdp.send('Input.dispatchTouchEvent', { type: 'touchCancel', touchPoints: [] });
  await restsForGood(1000);
});

test('a finger holds for long: it moves on, started once', async () => {
  const { page, cdp } = await pressed(true);
  const begun = await stack.truth(AXIS);
  await sleep(2500);
  const now = await stack.truth(AXIS);
  assert.ok(now.moving && now.starts === begun.starts);
  assert.equal(await page.locator('.jog-pad').getAttribute('data-hold'), 'held');
  await cdp.send('Input.dispatchTouchEvent', { type: 'touchEnd', touchPoints: [] });
  await restsForGood(1000);
});

test('a move whose packet is held up moves nothing, and one before a stop is ended by it', async () => {
  const { page } = await held();
  const before = await stack.truth(AXIS);
  const field = page.locator('.controls .move input').first();
  await page.locator('.controls .choice .button', { hasText: 'by' }).click();
  await field.fill('90');
  const move = page.locator('[data-act="move"]:not([aria-disabled="true"])');
  await move.waitFor();
  stack.network.cut();
  await move.click();
  await sleep(700);  // not so long that control would be lost
  stack.network.join();
  await page.locator('.notices li.error', { hasText: 'held up on its way' }).waitFor();
  const { rest } = await restsForGood(100);
  assert.equal(rest.starts, before.starts, 'it was started by a packet that came late');
  // Behind one another, however the network holds them up.
  for (const ms of [0, 30, 60]) {
    await move.waitFor();
    stack.network.cut();
    await move.click();
    await page.evaluate((axis) => document.querySelector(`[data-stop="${axis}"]`)!.dispatchEvent(new MouseEvent('click', { detail: 0, bubbles: true })), AXIS);
    await sleep(ms);
    stack.network.join();
    await until(async () => await page.locator('.report .outcomes li').count() === 1, 'the stop is answered', 5000);
    await restsForGood(3000);
  }
});

test('STOP ALL: every axis says what became of it, and a question comes before the release', async () => {
  const { page } = await pressed();
  await page.keyboard.press('Tab');
  await page.evaluate(() => document.querySelector('[data-stop="all"]')!.dispatchEvent(new MouseEvent('click', { detail: 0, bubbles: true })));
  await restsForGood(1000);
  await until(async () => await page.locator('.report .outcomes li').count() === 6, 'six outcomes', 3000);
  await page.mouse.up();
  await page.locator('.banner.warning button').click();
  await page.locator('.dialog .primary').click();
  await until(async () => await page.locator('.banner.warning').count() === 0, 'released', 3000);
  await restsForGood(100);
});
