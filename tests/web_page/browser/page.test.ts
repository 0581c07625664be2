// The page alone, before a gateway that is made up: sizes, languages, what it holds while nobody looks.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import type { Browser, Page } from 'playwright-core';
import { Role } from '@proto/access_pb';
import { Reason } from '@proto/error_pb';
import { refusal } from '../mock/axis';
import { assertReachable, closeAll, launch, open, ready, until, violations } from './support';

let browser: Browser;
before(async () => { browser = await launch(); });
after(() => closeAll(browser));

const screens = ['machine', 'axis', 'scope', 'groups', 'terminals', 'buses', 'events', 'people'];

/** Sets what the page sees of its visibility, as a browser does when the tab is covered. */
async function visibility(page: Page, state: 'hidden' | 'visible'): Promise<void> {
  await page.evaluate((now) => {
    Object.defineProperty(document, 'visibilityState', { configurable: true, get: () => now });
    Object.defineProperty(document, 'hidden', { configurable: true, get: () => now === 'hidden' });
    document.dispatchEvent(new Event('visibilitychange'));
  }, state);
}

test('first load: everything from here while no other host can be reached, and nothing is asked of one', async () => {
  const opened = await open(browser);
  const { page, url } = opened;
  const elsewhere = await (await opened.context.newPage()).goto('http://axisd.example/').catch((error: Error) => error.message);
  assert.match(String(elsewhere), /ERR_NAME_NOT_RESOLVED/);
  const hosts = new Set<string>();
  page.on('request', (request) => hosts.add(new URL(request.url()).origin));
  await page.reload();
  await page.locator('tr[data-axis="feeder"]').waitFor();
  await page.goto(`${url}/axis/feeder`);
  await page.locator('.uplot').waitFor();
  assert.deepEqual([...hosts], [url]);
  await opened.close();
});

test('panel: stops and jog buttons are 20 mm, the rest at least 72 px, 4 mm apart', async () => {
  const opened = await open(browser, { panel: true, width: 1280, height: 800, touch: true });
  const { page } = opened;
  await page.locator('tr[data-axis="feeder"]').waitFor();
  for (const screen of screens) {
    await page.locator(`nav a[href="/${screen}"]`).click();
    await page.locator(`nav a[href="/${screen}"][aria-current]`).waitFor();
    await page.waitForTimeout(150);
    await assertReachable(page, screen);
  }
  await opened.close();
});

test('the stops are on every screen at one place, and no question covers them', async () => {
  const opened = await open(browser, { panel: true, width: 1280, height: 800 });
  const { page } = opened;
  await page.locator('tr[data-axis="feeder"]').waitFor();
  const places = new Set<string>();
  for (const screen of screens) {
    await page.locator(`nav a[href="/${screen}"]`).click();
    await page.locator(`nav a[href="/${screen}"][aria-current]`).waitFor();
    for (const stop of await page.locator('.stops .stop').all()) places.add(JSON.stringify(await stop.boundingBox()));
  }
  assert.equal(places.size, 2);
  await page.locator('nav a[href="/axis"]').click();
  await page.locator('.controls .field input').first().click();
  await page.locator('.keypad').waitFor();
  await page.locator('[data-stop="all"]').click();
  await until(() => opened.gateway.machine.inhibitedBy !== '', 'STOP ALL arrives while a question is open');
  await opened.close();
});

test('axe finds nothing, on any screen, in light and dark', async () => {
  for (const theme of ['light', 'dark'] as const) {
    const opened = await open(browser, { theme });
    const { page } = opened;
    await page.locator('tr[data-axis="feeder"]').waitFor();
    for (const screen of screens) {
      await page.locator(`nav a[href="/${screen}"]`).click();
      await page.waitForTimeout(300);
      assert.deepEqual(await violations(page), [], `${screen}, ${theme}`);
    }
    await opened.close();
  }
});

test('languages: the page speaks each, and says so', async () => {
  for (const [lang, word, code] of [['en', 'Standstill', 'en'], ['de', 'Stillstand', 'de'], ['zh', '静止', 'zh-Hans']] as const) {
    const opened = await open(browser, { lang, path: '/axis/feeder' });
    await opened.page.locator('[data-act="take-control"]').click();
    await opened.page.locator('[data-act="enable"]').click();
    await opened.page.locator('.axis-head .badge', { hasText: word }).waitFor();
    assert.equal(await opened.page.locator('html').getAttribute('lang'), code);
    await opened.close();
  }
});

test('a page starts as observer: whatever cannot be used says why, and leads out', async () => {
  const opened = await open(browser, { path: '/axis/pusher' });
  const { page, gateway } = opened;
  const reasons = page.locator('.controls .reasons li');
  await reasons.first().waitFor();
  assert.equal(await reasons.count(), 1);
  assert.match((await reasons.first().textContent())!, /take control first/);
  await page.locator('[data-act="enable"]').click({ force: true });
  assert.equal(gateway.machine.commands.length, 0, 'a button that says why it cannot be used does nothing');
  await page.locator('[data-remedy="take-control"]').click();
  await page.locator('[data-remedy="enable"]').click();
  await until(async () => (await reasons.count()) === 0, 'nothing is in the way any more');
  // Beyond the limit: the same text as the refusal, and the nearest value as its remedy.
  const [to, at] = [page.locator('.controls .move input').nth(0), page.locator('.controls .move input').nth(1)];
  await to.fill('80');
  await page.locator('[data-explain]', { hasText: 'target 80 mm is beyond a software limit' }).waitFor();
  await page.locator('[data-remedy="use"]').click();
  assert.equal(await to.inputValue(), '50');
  await at.fill('999');
  await page.locator('[data-explain]', { hasText: 'out of range' }).waitFor();
  await page.locator('[data-remedy="use"]').click();
  assert.equal(await at.inputValue(), '40');
  await page.locator('[data-act="move"]:not([aria-disabled="true"])').click();
  await until(() => gateway.machine.axis('pusher').moving, 'it moves');
  await opened.close();
});

test('a person who may only look has no more than that, and the stops', async () => {
  const opened = await open(browser, { path: '/axis/feeder' });
  opened.gateway.world.role = Role.VIEWER;
  await opened.page.reload();
  await opened.page.locator('.reasons li', { hasText: 'role operator' }).waitFor();
  await opened.page.locator('.stops [data-stop="feeder"]').click();
  await until(() => opened.gateway.lane.some(({ method }) => method.endsWith('/Stop')), 'the stop goes over the lane');
  await opened.close();
});

test('an axis that another leases is taken only after a question that names who', async () => {
  const opened = await open(browser, { path: '/axis/feeder' });
  const { page, gateway } = opened;
  const other = gateway.machine.lease(['feeder'], 60_000, 'shift-b', false);
  await page.locator('.controls [data-act="take-control"]').click();
  await page.locator('.dialog', { hasText: 'shift-b' }).waitFor();
  assert.ok(gateway.machine.leases.has(other.token));
  await page.locator('.dialog .primary').click();
  await page.locator('[data-act="give-back"]').waitFor();
  assert.ok(!gateway.machine.leases.has(other.token));
  await opened.close();
});

test('control ends when another takes it, and the page says so', async () => {
  const opened = await open(browser, { path: '/axis/feeder' });
  const { page, gateway } = opened;
  await ready(page);
  gateway.machine.lease(['feeder'], 60_000, 'shift-b', true);
  await page.locator('.notices', { hasText: 'Somebody else took control of feeder' }).waitFor();
  await page.locator('.controls [data-act="take-control"]').waitFor();
  await opened.close();
});

test('hold to run: moves while held, renewed by one press, halts at the release', async () => {
  const opened = await open(browser, { path: '/axis/feeder' });
  const { page, gateway } = opened;
  await ready(page);
  const feeder = gateway.machine.axis('feeder');
  await page.locator('[data-jog="+"]:not([aria-disabled="true"])').hover();
  await page.mouse.down();
  await until(() => feeder.renewals > 4, 'it is renewed');
  assert.equal(await page.locator('.jog-pad').getAttribute('data-hold'), 'held');
  await page.mouse.up();
  await until(() => !feeder.moving, 'it rests');
  const jogs = gateway.machine.commands.filter(({ kind }) => kind === 7);
  assert.equal(jogs.length, 1);
  const gone = feeder.gone;
  await page.waitForTimeout(500);
  assert.equal(feeder.gone, gone);
  assert.equal(gateway.lane.at(-1)!.method.endsWith('/Jog'), false);
  await opened.close();
});

test('hold to run: whatever ends it, the button has to be let go first', async () => {
  const opened = await open(browser, { path: '/axis/feeder' });
  const { page, gateway } = opened;
  await ready(page);
  const feeder = gateway.machine.axis('feeder');
  const pad = page.locator('.jog-pad');
  const endings: [string, () => Promise<unknown>][] = [
    ['blur', () => page.evaluate(() => window.dispatchEvent(new Event('blur')))],
    ['contextmenu', () => page.evaluate(() => document.querySelector('[data-jog="+"]')!.dispatchEvent(new MouseEvent('contextmenu', { bubbles: true, cancelable: true })))],
    ['second finger', () => page.evaluate(() => document.body.dispatchEvent(new PointerEvent('pointerdown', { pointerId: 99, bubbles: true, isPrimary: false })))],
    ['pointercancel', () => page.evaluate(() => document.querySelector('[data-jog="+"]')!.dispatchEvent(new PointerEvent('pointercancel', { pointerId: 1, bubbles: true })))],
    ['lane', async () => gateway.closeLanes()]];
  for (const [what, end] of endings) {
    await page.locator('[data-jog="+"]:not([aria-disabled="true"])').hover();
    await until(async () => (await page.locator('.fact.warn').count()) === 0, 'the lane is quick');
    await page.mouse.down();
    await until(() => feeder.moving, `${what}: it moves`);
    await end();
    await until(() => !feeder.moving, `${what}: it rests`);
    await until(async () => (await pad.getAttribute('data-hold')) === 'lost', `${what}: it is lost`);
    const gone = feeder.gone;
    await page.waitForTimeout(250);
    assert.equal(feeder.gone, gone, `${what}: still down, and nothing moves`);
    await page.mouse.up();
    await until(async () => (await pad.getAttribute('data-hold')) === 'idle', `${what}: let go`);
  }
  await opened.close();
});

test('hold to run: a page that hung for 3 s renews nothing, and halts', async () => {
  const opened = await open(browser, { path: '/axis/feeder' });
  const { page, gateway } = opened;
  await ready(page);
  const feeder = gateway.machine.axis('feeder');
  await page.locator('[data-jog="+"]:not([aria-disabled="true"])').hover();
  await page.mouse.down();
  await until(() => feeder.renewals > 2, 'it is renewed');
  const before = gateway.lane.filter(({ method }) => method.endsWith('/Jog')).length;
  await page.evaluate(() => { const end = performance.now() + 3000; while (performance.now() < end); });
  await until(async () => (await page.locator('.jog-pad').getAttribute('data-hold')) === 'lost', 'it is lost');
  assert.equal(feeder.moving, false);
  const during = gateway.lane.filter(({ method }) => method.endsWith('/Jog')).length - before;
  assert.ok(during <= 2, `${during} renewals`);
  await page.mouse.up();
  await opened.close();
});

test('a click that a busy page hears too late starts nothing, and the page says so', async () => {
  const opened = await open(browser, { path: '/axis/feeder' });
  const { page, gateway } = opened;
  await ready(page);
  await page.locator('.controls .move input').first().fill('150');
  const move = page.locator('[data-act="move"]:not([aria-disabled="true"])');
  const box = (await move.boundingBox())!;
  const hangs = page.waitForEvent('console', (message) => message.text() === 'hangs');
  const hang = page.evaluate(() => { console.log('hangs'); const end = performance.now() + 1000; while (performance.now() < end); });
  await hangs;
  // Without waiting for what the page says to each part of it.
  const cdp = await opened.context.newCDPSession(page);
  const at = { x: box.x + box.width / 2, y: box.y + box.height / 2, button: 'left', clickCount: 1 } as const;
  await Promise.all([cdp.send('Input.dispatchMouseEvent', { type: 'mousePressed', ...at }), cdp.send('Input.dispatchMouseEvent', { type: 'mouseReleased', ...at }), hang]);
  await page.locator('.notices', { hasText: 'too busy to hear that in time' }).waitFor();
  assert.equal(gateway.machine.axis('feeder').gone, 0);
  await move.click();
  await until(() => gateway.machine.axis('feeder').moving, 'it moves');
  await opened.close();
});

test('hold to run by keys: an arrow moves with the dead-man key only, and never by repeat', async () => {
  const opened = await open(browser, { path: '/axis/feeder' });
  const { page, gateway } = opened;
  await ready(page);
  const feeder = gateway.machine.axis('feeder');
  await page.locator('.jog-pad').focus();
  await page.keyboard.down('ArrowRight');
  await page.waitForTimeout(200);
  assert.equal(feeder.moving, false);
  await page.keyboard.down('Shift');
  await page.keyboard.down('ArrowRight');
  await page.waitForTimeout(200);
  assert.equal(feeder.moving, false, 'a repeat is no press');
  await page.keyboard.up('ArrowRight');
  await page.keyboard.down('ArrowRight');
  await until(() => feeder.moving, 'it moves');
  await page.keyboard.up('Shift');
  await until(() => !feeder.moving, 'it rests');
  await page.keyboard.up('ArrowRight');
  await opened.close();
});

test('keys in the field beside the buttons move its cursor, and no axis', async () => {
  const opened = await open(browser, { path: '/axis/feeder' });
  await ready(opened.page);
  await opened.page.locator('.jog-pad input').fill('50');
  await opened.page.keyboard.down('Shift');
  await opened.page.keyboard.down('ArrowLeft');
  await opened.page.waitForTimeout(300);
  assert.equal(opened.gateway.machine.axis('feeder').gone, 0);
  await opened.close();
});

test('hold to run ends when the states no longer arrive, though the lane is quick', async () => {
  const opened = await open(browser, { path: '/axis/feeder' });
  const { page, gateway } = opened;
  await ready(page);
  await page.locator('[data-jog="+"]:not([aria-disabled="true"])').hover();
  await page.mouse.down();
  await until(() => gateway.machine.axis('feeder').moving, 'it moves');
  gateway.world.silent = true;
  await until(() => !gateway.machine.axis('feeder').moving, 'it rests', 1500);
  await page.locator('.jog-said', { hasText: 'no longer hears from the machine' }).waitFor();
  await page.mouse.up();
  await opened.close();
});

test('hold to run is refused with the reason while the lane takes longer than 300 ms', async () => {
  const opened = await open(browser, { path: '/axis/feeder' });
  const { page, gateway } = opened;
  await ready(page);
  gateway.laneDelay = 450;
  await page.locator('.jog-said', { hasText: 'too slow to jog' }).waitFor();
  await page.locator('[data-jog="+"]').hover({ force: true });
  await page.mouse.down();
  await page.locator('.jog-said', { hasText: 'takes more than 300 ms' }).waitFor();
  await page.waitForTimeout(600);
  assert.equal(gateway.machine.axis('feeder').gone, 0);
  await page.mouse.up();
  await opened.close();
});

test('a hidden tab holds no stream, no lane and no axis; seen again it is live again', async () => {
  const opened = await open(browser, { path: '/axis/feeder' });
  const { page, gateway } = opened;
  await ready(page);
  await visibility(page, 'hidden');
  await until(() => gateway.world.streams === 0, 'no stream is left');
  await until(() => gateway.machine.leases.size === 0, 'the lease is given back');
  await visibility(page, 'visible');
  await until(() => gateway.world.streams === 1, 'the stream is back');
  await page.locator('.notices', { hasText: 'as the page was hidden' }).waitFor();
  await opened.close();
});

test('without a stream nothing is shown as live', async () => {
  const opened = await open(browser);
  const { page, gateway } = opened;
  const row = page.locator('tr[data-axis="feeder"]');
  await row.waitFor();
  assert.doesNotMatch((await row.getAttribute('class'))!, /stale/);
  gateway.world.silent = true;
  await until(async () => /stale/.test((await row.getAttribute('class'))!), 'the values are old');
  assert.match((await row.locator('.position').textContent())!, /^\(120\.000 mm\)/);
  await page.locator('.banner.alarm').waitFor();
  gateway.world.silent = false;
  await until(async () => !/stale/.test((await row.getAttribute('class'))!), 'the values are live again', 15_000);
  await opened.close();
});

test('a page that the daemon refuses says so, with what to do', async () => {
  const opened = await open(browser);
  const { page, gateway } = opened;
  await page.locator('tr[data-axis="feeder"]').waitFor();
  gateway.world.refusal = refusal(Reason.ACCESS_DENIED, 'web may not speak for others', 'name web under access: delegates in the configuration');
  await page.reload();
  const banner = page.locator('.banner.alarm', { hasText: 'The daemon refuses this page.' });
  await banner.waitFor();
  assert.match((await banner.locator('.detail').textContent())!, /^web may not speak for others; name web under access: delegates/);
  assert.doesNotMatch((await banner.textContent())!, /is lost/);
  assert.match((await page.locator('header').textContent())!, /shift-a$/);
  gateway.world.refusal = undefined;
  await page.locator('tr[data-axis="feeder"]:not(.stale)').waitFor({ timeout: 15_000 });
  await opened.close();
});

test('a stop while the lane is gone goes by a call', async () => {
  const opened = await open(browser);
  const { page, gateway } = opened;
  await page.locator('tr[data-axis="feeder"]').waitFor();
  gateway.laneDelay = 60_000;
  await page.locator('[data-stop="all"]').click();
  await until(() => gateway.machine.inhibitedBy !== '', 'STOP ALL arrives');
  assert.ok(gateway.requests.includes('/axisd.v1.SystemService/StopAll'));
  await page.locator('.report .outcomes li').first().waitFor();
  assert.equal(await page.locator('.report .outcomes li').count(), 6);
  await opened.close();
});

test('log-in: a wrong password says so, a session that ends leads back to it', async () => {
  const opened = await open(browser);
  const { page, gateway } = opened;
  gateway.password = 'secret';
  await page.reload();
  await page.locator('input[name="name"]').fill('shift-a');
  await page.locator('input[name="password"]').fill('wrong');
  await page.locator('button[type="submit"]').click();
  await page.locator('[role="alert"]', { hasText: 'wrong name or password' }).waitFor();
  await page.locator('input[name="password"]').fill('secret');
  await page.locator('button[type="submit"]').click();
  await page.locator('tr[data-axis="feeder"]').waitFor();
  await page.locator('nav a[href="/people"]').click();
  await page.locator('button', { hasText: 'Sign out' }).click();
  await page.locator('input[name="password"]').waitFor();
  await opened.close();
});

test('120 axes: every row is there, and the numbers go on', async () => {
  const many = Array.from({ length: 120 }, (_, index) => ({
    name: `axis-${index}`, unit: 'mm', bus: 'line-a', node: index + 1, model: 'ykd2405pr', low: 0, high: 400, fastest: 100, start: index, inputs: [], outputs: [] }));
  const opened = await open(browser, {}, many);
  const { page, gateway } = opened;
  await until(async () => (await page.locator('tr[data-axis]').count()) === 120, '120 rows', 10_000);
  gateway.machine.axis('axis-7').velocity = 20;
  gateway.machine.axis('axis-7').target = 200;
  const text = () => page.locator('tr[data-axis="axis-7"] .position').textContent();
  const first = await text();
  await until(async () => (await text()) !== first, 'it changes');
  await opened.close();
});

test('scope: a motion is recorded by itself, with one second before; its table has each sample', async () => {
  const opened = await open(browser, { path: '/axis/feeder' });
  const { page } = opened;
  await ready(page);
  await page.waitForTimeout(1200);
  await page.locator('.controls .move input').first().fill('150');
  await page.locator('[data-act="move"]:not([aria-disabled="true"])').click();
  await page.locator('nav a[href="/scope"]').click();
  await page.locator('.records .button').first().click();
  const [download] = await Promise.all([page.waitForEvent('download'), page.locator('[data-act="csv"]').click()]);
  const lines = readFileSync((await download.path())!, 'utf8').trim().split('\r\n').map((line) => line.split(','));
  const [head, ...rows] = lines;
  assert.deepEqual(head!.slice(0, 9), ['time', 'axis', 'unit', 'position', 'velocity', 'target', 'following_error', 'moving', 'state']);
  const moving = rows.findIndex((row) => row[7] === '1');
  assert.ok(moving > 5 && Date.parse(rows[moving]![0]!) - Date.parse(rows[0]![0]!) <= 1100);
  assert.equal(Number(rows.at(-1)![3]), 150);
  // Cursors.
  const plot = page.locator('.u-over').first();
  const box = (await plot.boundingBox())!;
  await page.mouse.click(box.x + box.width * 0.2, box.y + 20);
  await page.mouse.click(box.x + box.width * 0.8, box.y + 20);
  const cells = await page.locator('.readings tbody tr').first().locator('td').allTextContents();
  assert.match(cells[2]!, /mm$/);
  const [png] = await Promise.all([page.waitForEvent('download'), page.locator('[data-act="png"]').click()]);
  assert.deepEqual([...readFileSync((await png.path())!).subarray(1, 4)], [0x50, 0x4e, 0x47]);
  await opened.close();
});

test('groups: a move shows skew and arrivals', async () => {
  const opened = await open(browser, { path: '/groups' });
  const { page, gateway } = opened;
  for (const name of ['feeder', 'turntable']) gateway.machine.axis(name).to(2);
  await page.locator('.group [data-act="take-control"]').click();
  await page.locator('.members input').nth(0).fill('140');
  await page.locator('.members input').nth(1).fill('300');
  await page.locator('.group [data-act="move"]:not([aria-disabled="true"])').click();
  await page.locator('.group-move', { hasText: 'Done' }).waitFor();
  assert.match((await page.locator('.group-move .figures').textContent())!, /9\.6 ms.*31\.5 ms/);
  await opened.close();
});
