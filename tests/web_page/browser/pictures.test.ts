// Pictures of each screen: light, dark, on a panel, in Chinese. They are looked at by people.
import { after, before, test } from 'node:test';
import type { Browser, Page } from 'playwright-core';
import { closeAll, launch, open, picture, ready, type Look } from './support';

let browser: Browser;
before(async () => { browser = await launch(); });
after(() => closeAll(browser));

const screens = ['machine', 'axis/feeder', 'scope/feeder', 'groups', 'terminals', 'buses', 'events', 'people'];
const looks: [string, Look][] = [
  ['light', {}], ['dark', { theme: 'dark' }], ['panel', { panel: true, width: 1280, height: 800, touch: true }], ['zh', { lang: 'zh' }]];

/** Also where a field that was typed into is further down. */
const fromTheTop = (page: Page) => page.evaluate(() => document.querySelector('main')!.scrollTo(0, 0));

for (const [name, look] of looks) {
  test(`pictures: ${name}`, async () => {
    const opened = await open(browser, { ...look, path: '/axis/feeder' });
    const { page } = opened;
    await ready(page);
    const fields = page.locator('.controls .move input');
    if (look.panel) {
      await fields.first().click();
      for (const key of ['2', '6', '0']) await page.locator(`.key-${key}`).click();
      await picture(page, `${name}-keypad`);
      await page.locator('.key-ok').click();
    } else {
      await fields.nth(0).fill('260');
      await fields.nth(1).fill('80');
    }
    await page.locator('[data-act="move"]').click();
    await page.waitForTimeout(1300);
    await fromTheTop(page);
    await picture(page, `${name}-moving`);
    await page.waitForTimeout(2600);
    for (const screen of screens) {
      const [id] = screen.split('/');
      await page.locator(`nav a[href="/${id}"]`).click();
      await page.waitForTimeout(id === 'scope' || id === 'buses' ? 900 : 350);
      await picture(page, `${name}-${id}`);
      }
    await page.locator('[data-stop="all"]').click();
    await page.locator('nav a[href="/machine"]').click();
    await page.waitForTimeout(400);
    await picture(page, `${name}-stopped`);
    await page.locator('nav a[href="/axis"]').click();
    await page.waitForTimeout(400);
    await picture(page, `${name}-explained`);
    opened.gateway.machines = [{ name: 'press-1', trouble: '' }, { name: 'press-2', trouble: 'axisd does not answer at press-2:7443' }];
    await page.goto(`${opened.url}/`);
    await page.locator('tr[data-machine="press-1"]', { hasText: '6' }).waitFor();
    await picture(page, `${name}-machines`);
    await opened.close();
  });
}

test('pictures: for the README', async () => {
  const opened = await open(browser, { width: 1200, height: 860, path: '/axis/feeder' });
  const { page } = opened;
  await ready(page);
  await page.waitForTimeout(1200);
  await page.locator('.controls .move input').nth(0).fill('260');
  await page.locator('.controls .move input').nth(1).fill('80');
  await page.locator('[data-act="move"]').click();
  await page.waitForTimeout(1300);
  await fromTheTop(page);
  await picture(page, 'readme-axis');
  await page.setViewportSize({ width: 1200, height: 720 });
  await page.evaluate(() => { document.documentElement.dataset['theme'] = 'dark'; });
  await page.locator('nav a[href="/machine"]').click();
  await page.waitForTimeout(350);
  await picture(page, 'readme-machine');
  await opened.close();
});
