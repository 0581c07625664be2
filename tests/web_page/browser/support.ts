// What the browser tests share: the built page behind a gateway that is made up, in Debian's Chromium.
import assert from 'node:assert/strict';
import { createRequire } from 'node:module';
import { mkdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import type { Browser, BrowserContext, Page } from 'playwright-core';
import { MockGateway } from '../mock/gateway';
import type { Model } from '../mock/axis';

const { chromium } = createRequire(process.env['AXISD_WEB_MODULES']!)('playwright-core') as typeof import('playwright-core');
const axePath = createRequire(process.env['AXISD_WEB_MODULES']!).resolve('axe-core/axe.min.js');

export const CHROMIUM = process.env['AXISD_CHROMIUM'] ?? '/usr/bin/chromium';

/** No host but this computer can be reached: the page needs no other. */
export function launch(): Promise<Browser> {
  return chromium.launch({ executablePath: CHROMIUM, args: ['--no-sandbox', '--disable-gpu', '--force-color-profile=srgb',
                                                            '--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE localhost'] });
}

export interface Opened { gateway: MockGateway; url: string; context: BrowserContext; page: Page; close(): Promise<void> }

export interface Look { width?: number; height?: number; panel?: boolean; theme?: 'light' | 'dark'; lang?: 'en' | 'de' | 'zh'; touch?: boolean; path?: string }

/** Opens a screen of a machine of its own. What goes wrong in the page fails the test. */
export async function open(browser: Browser, look: Look = {}, axes?: readonly Model[]): Promise<Opened> {
  const gateway = axes === undefined ? new MockGateway(process.env['AXISD_WEB_PAGE']!) : new MockGateway(process.env['AXISD_WEB_PAGE']!, axes);
  const url = await gateway.listen();
  const context = await browser.newContext({
    viewport: { width: look.width ?? 1440, height: look.height ?? 900 }, hasTouch: look.touch ?? false, locale: 'en-GB', reducedMotion: 'reduce', timezoneId: 'Europe/Berlin' });
  const page = await context.newPage();
  const errors: string[] = [];
  page.on('pageerror', (error) => errors.push(String(error)));
  page.on('console', (message) => { if (message.type() === 'error' && !/401|Failed to load resource|WebSocket/.test(message.text())) errors.push(message.text()); });
  const query = new URLSearchParams({ panel: look.panel ? '1' : '0', theme: look.theme ?? 'light', lang: look.lang ?? 'en' });
  await page.goto(`${url}${look.path ?? '/'}?${query}`);
  let closed = false;
  const opened: Opened = {
    gateway, url, context, page,
    async close() {
      if (closed) return;
      closed = true;
      all.delete(opened);
      await context.close();
      await gateway.close();
      if (errors.length > 0) throw new Error(errors.join('\n'));
    },
  };
  all.add(opened);
  return opened;
}

const all = new Set<Opened>();

/** Also of tests that failed. */
export async function closeAll(browser: Browser): Promise<void> {
  for (const opened of [...all]) await opened.close().catch(() => {});
  await browser.close();
}

/** Waits until something holds. */
export async function until(holds: () => boolean | Promise<boolean>, what: string, atMost = 5000): Promise<void> {
  const end = performance.now() + atMost;
  while (!(await holds())) {
    if (performance.now() > end) throw new Error(`not within ${atMost} ms: ${what}`);
    await new Promise((resolve) => setTimeout(resolve, 10));
  }
}

export async function picture(page: Page, name: string): Promise<void> {
  const folder = process.env['AXISD_WEB_PICTURES']!;
  mkdirSync(folder, { recursive: true });
  await page.screenshot({ path: join(folder, `${name}.png`) });
}

/** Takes control of the axis that is shown, and enables it. */
export async function ready(page: Page): Promise<void> {
  await page.locator('[data-act="take-control"]').first().click();
  await page.locator('[data-act="give-back"]').waitFor();
  const enable = page.locator('[data-act="enable"]:not([aria-disabled="true"])');
  await enable.click();
  await page.locator('[data-act="disable"]').waitFor();
}

/** What axe finds wrong with what is shown. */
export async function violations(page: Page): Promise<string[]> {
  // The page's own rules forbid scripts from elsewhere; the debugger may.
  await page.evaluate(readFileSync(axePath, 'utf8'));
  return page.evaluate(async () => {
    const { axe } = window as unknown as { axe: { run(options: object): Promise<{ violations: { id: string; nodes: { html: string; failureSummary: string }[] }[] }> } };
    const { violations: found } = await axe.run({ rules: { 'color-contrast-enhanced': { enabled: true } } });
    return found.map(({ id, nodes }) => `${id}: ${nodes.map(({ html, failureSummary }) => `${html} ${failureSummary}`).join(' | ').slice(0, 600)}`);
  });
}

/** On a panel: what can be pressed is large enough, and far enough from what else can be. */
export async function assertReachable(page: Page, screen: string): Promise<void> {
  const boxes = await page.evaluate(() => [...document.querySelectorAll<HTMLElement>('button, a[href], select, input')]
    .filter((element) => element.checkVisibility()).map((element) => {
      const target = element.closest('.field')?.querySelector('.box') ?? element;
      const { x, y, width, height } = target.getBoundingClientRect();
      return { what: `${element.tagName} ${element.textContent?.slice(0, 30)}`, big: element.matches('.stop, [data-jog]'), inline: element.matches('header a, p a'),
               x, y, width, height };
    }));
  for (const box of boxes) {
    if (box.inline) continue;
    const least = box.big ? 118 : 72;
    assert.ok(box.width >= least - 0.5 || (!box.big && box.what.startsWith('A ')), `${screen}: ${box.what} is ${box.width} px wide`);
    assert.ok(box.height >= least - 0.5, `${screen}: ${box.what} is ${box.height} px high`);
  }
  for (const [index, a] of boxes.entries()) {
    for (const b of boxes.slice(index + 1)) {
      if (a.inline || b.inline) continue;
      const dx = Math.max(a.x, b.x) - Math.min(a.x + a.width, b.x + b.width);
      const dy = Math.max(a.y, b.y) - Math.min(a.y + a.height, b.y + b.height);
      assert.ok(Math.max(dx, dy) >= 23.4, `${screen}: ${a.what} and ${b.what} are ${Math.max(dx, dy).toFixed(1)} px apart`);
    }
  }
}
