// A tab that is really covered, and frozen by its browser: headless, each tab takes itself for seen.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { Headed, type Tab } from './headed';
import { AXIS, Hold } from './hold';
import { Stack, until } from './stack';

let stack: Stack;
let hold: Hold;
let browser: Headed;

before(async () => {
  stack = new Stack();
  hold = new Hold(stack);
  browser = new Headed();
  await stack.start();
  await browser.start();
});
after(async () => {
  await browser?.close();
  await stack?.close();
});

const one = (selector: string) => `document.querySelector(${JSON.stringify(selector)})`;
// While a page is being loaded there is nothing that could be asked.
const there = (tab: Tab, selector: string) => until(() => tab.value<boolean>(`${one(selector)} !== null`).catch(() => false), selector, 20_000);
const click = async (tab: Tab, selector: string) => { await there(tab, selector); await tab.value(`${one(selector)}.click()`); };

/** A page that has control of the axis, which is enabled. */
async function controlled(): Promise<Tab> {
  const tab = await browser.open(`${stack.url}/axis/${AXIS}?panel=0&theme=light&lang=en`);
  await click(tab, '.controls [data-act="take-control"]');
  await there(tab, '[data-act="give-back"]');
  await there(tab, '[data-act="enable"], [data-act="disable"]');
  if (await tab.value<boolean>(`${one('[data-act="disable"]')} === null`)) await click(tab, '[data-act="enable"]:not([aria-disabled="true"])');
  await there(tab, '[data-jog="+"]:not([aria-disabled="true"])');
  await until(() => tab.value<boolean>(`${one('.fact.warn')} === null`), 'the lane is quick', 20_000);
  return tab;
}

/** The same with a finger on the button, and the axis in motion. */
async function pressed(): Promise<Tab> {
  const tab = await controlled();
  const at = await tab.value<{ x: number; y: number }>(
    `(() => { const { x, y, width, height } = ${one('[data-jog="+"]')}.getBoundingClientRect(); return { x: x + width / 2, y: y + height / 2 }; })()`);
  await tab.send('Input.dispatchMouseEvent', { type: 'mouseMoved', ...at });
  await tab.send('Input.dispatchMouseEvent', { type: 'mousePressed', ...at, button: 'left', buttons: 1, clickCount: 1 });
  await until(async () => (await stack.truth(AXIS)).moving, 'it moves', 5000).catch(async (error: Error) => {
    throw new Error(`${error.message}: ${await tab.value<string>(`${one('.controls')}.innerText`)}`);
  });
  return tab;
}

const visibility = (tab: Tab) => tab.value<string>('document.visibilityState');

async function cover(tab: Tab): Promise<void> {
  await browser.open('about:blank');
  await until(async () => await visibility(tab) === 'hidden', 'the page is hidden', 5000);
}

async function uncover(tab: Tab): Promise<void> {
  await tab.show();
  await until(async () => await visibility(tab) === 'visible', 'the page is seen', 5000);
}

const leases = async () => (JSON.parse(await stack.axisctl('lease', 'list', '--json')) as { leases?: unknown[] }).leases?.length ?? 0;

test('another tab covers it while a button is held', async () => {
  const tab = await pressed();
  await cover(tab);
  await hold.restsForGood(1500);
  await until(async () => await leases() === 0, 'control is given back', 5000);
  await uncover(tab);
  await hold.restsForGood(100);
  await until(() => tab.value<boolean>(`${one('.notices')}.innerText.includes('as the page was hidden')`), 'it says so', 5000);
});

test('it is covered and frozen while a button is held', async () => {
  const tab = await pressed();
  await cover(tab);
  await tab.send('Page.setWebLifecycleState', { state: 'frozen' });
  await hold.restsForGood(1500);
  await tab.send('Page.setWebLifecycleState', { state: 'active' });
  await uncover(tab);
  await hold.restsForGood(100);
});

test('a move that was started ends with the lease that a covered page gives back', async () => {
  const tab = await controlled();
  const before = await stack.truth(AXIS);
  await tab.value(`[...document.querySelectorAll('.controls .choice .button')].find((button) => button.textContent === 'by').click()`);
  await tab.value(`(() => { const field = ${one('.controls .move input')}; field.value = '3000'; field.dispatchEvent(new Event('input', { bubbles: true })); })()`);
  await click(tab, '[data-act="move"]:not([aria-disabled="true"])');
  await until(async () => (await stack.truth(AXIS)).moving, 'it moves', 5000);
  await cover(tab);
  const { rest } = await hold.restsForGood(5000);
  assert.equal(rest.starts, before.starts + 1);
  assert.ok(rest.position - before.position < 2900, 'it did not go all the way');
});
