// A finger on a button that moves an axis, and the simulated load that tells what became of it.
import assert from 'node:assert/strict';
import type { Browser, CDPSession, Page } from 'playwright-core';
import { sleep, until, type Stack, type Truth } from './stack';

export const AXIS = 'turntable';
/** How long nothing may move afterwards. */
const QUIET_MS = 3000;

/** `at`: where the button is. */
export interface Held { page: Page; cdp: CDPSession; at: { x: number; y: number } }

export class Hold {
  constructor(private readonly stack: Stack) {}

  /** A page of the axis, under control, enabled, with a finger on the button and the axis in motion. */
  async held(browser: Browser, touch = false): Promise<Held> {
    // What an earlier row left behind: after the daemon's end nobody knows what became of the jog.
    if ((await this.stack.axisctl('state', AXIS, '--json')).includes('STATE_ERROR_STOP')) await this.stack.axisctl('reset', AXIS, '--wait');
    const context = await browser.newContext({ viewport: { width: 1440, height: 900 }, hasTouch: touch });
    const page = await context.newPage();
    await page.goto(`${this.stack.url}/axis/${AXIS}?panel=0&theme=light&lang=en`);
    await page.locator('.controls [data-act="take-control"]').click();
    await page.locator('[data-act="give-back"]').waitFor();
    const enable = page.locator('[data-act="enable"]:not([aria-disabled="true"])');
    if (await page.locator('[data-act="disable"]').count() === 0) await enable.click();
    const button = page.locator('[data-jog="+"]:not([aria-disabled="true"])');
    await button.waitFor();
    await until(async () => await page.locator('.fact.warn').count() === 0, 'the lane is quick', 10_000);
    const box = (await button.boundingBox())!;
    const at = { x: box.x + box.width / 2, y: box.y + box.height / 2 };
    const cdp = await context.newCDPSession(page);
    return { page, cdp, at };
  }

  async pressed(browser: Browser, touch = false): Promise<Held> {
    const opened = await this.held(browser, touch);
    const { page, cdp, at } = opened;
    if (touch) await cdp.send('Input.dispatchTouchEvent', { type: 'touchStart', touchPoints: [{ ...at, id: 1 }] });
    else { await page.mouse.move(at.x, at.y); await page.mouse.down(); }
    await until(async () => (await this.stack.truth(AXIS)).moving, 'it moves', 5000).catch(async (error: Error) => {
      throw new Error(`${error.message}: ${await page.locator('.controls').innerText()} ${await page.locator('.axis-head').innerText()}`);
    });
    await sleep(300);
    return opened;
  }

  /** It comes to rest, and then nothing moves, although the button may still be down. */
  async restsForGood(atMost: number): Promise<{ rest: Truth; took: number }> {
    const took = await until(async () => !(await this.stack.truth(AXIS)).moving, 'it rests', atMost);
    const rest = await this.stack.truth(AXIS);
    for (const end = performance.now() + QUIET_MS; performance.now() < end; await sleep(100)) {
      const now = await this.stack.truth(AXIS);
      assert.equal(now.moving, false, 'it moved afterwards');
      assert.ok(Math.abs(now.position - rest.position) < 0.05, `it moved afterwards: from ${rest.position} to ${now.position}`);
      assert.equal(now.starts, rest.starts, 'it was started again');
    }
    return { rest, took };
  }
}
