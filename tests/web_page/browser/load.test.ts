// What a page costs: 64 axes at 20 Hz, and four curves of them.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import type { Browser } from 'playwright-core';
import { closeAll, launch, open } from './support';

let browser: Browser;
before(async () => { browser = await launch(); });
after(() => closeAll(browser));

test('64 axes at 20 Hz leave the page most of its time, and its memory does not grow', async () => {
  const many = Array.from({ length: 64 }, (_, index) => ({
    name: `axis-${index}`, unit: 'mm', bus: 'line-a', node: index + 1, model: 'ykd2405pr', low: 0, high: 400, fastest: 100, start: index,
    inputs: [['X0', 'home']] as [string, string][], outputs: [] }));
  const opened = await open(browser, {}, many);
  const { page, gateway } = opened;
  for (const axis of gateway.machine.axes.values()) { axis.velocity = 0.01; axis.target = 400; }
  await page.locator('tr[data-axis="axis-63"]').waitFor();
  const cdp = await opened.context.newCDPSession(page);
  await cdp.send('Performance.enable', { timeDomain: 'threadTicks' });
  const metric = async (name: string) => (await cdp.send('Performance.getMetrics')).metrics.find((known) => known.name === name)!.value;
  for (const screen of ['machine', 'scope']) {
    await page.locator(`nav a[href="/${screen}"]`).click();
    if (screen === 'scope') for (const index of [1, 2, 3]) await page.locator('.chips .button', { hasText: new RegExp(`^axis-${index}$`) }).click();
    await page.waitForTimeout(1000);
    const [before, begun] = [await metric('TaskDuration'), performance.now()];
    await page.waitForTimeout(4000);
    const share = (await metric('TaskDuration') - before) / ((performance.now() - begun) / 1000);
    console.log(`${screen}: ${(share * 100).toFixed(0)} % of the page's thread`);
    assert.ok(share < 0.5, `${screen}: ${(share * 100).toFixed(0)} %`);
  }
  const heap = async () => {
    await cdp.send('HeapProfiler.collectGarbage');
    return (await metric('JSHeapUsedSize')) / 1e6;
  };
  await page.locator('nav a[href="/machine"]').click();
  const first = await heap();
  await page.waitForTimeout(5000);
  const grown = (await heap()) - first;
  console.log(`heap ${first.toFixed(1)} MB, ${grown.toFixed(1)} MB more after 5 s`);
  // The ten minutes that are kept fill meanwhile: 64 axes, 100 samples, some 50 bytes each.
  assert.ok(grown < 3, `${grown.toFixed(1)} MB`);
  await opened.close();
});

test('at 10 Mbit/s the first values are there within 1.5 s', async () => {
  const opened = await open(browser);
  const { page, url } = opened;
  const cdp = await opened.context.newCDPSession(page);
  await cdp.send('Network.enable');
  await cdp.send('Network.setCacheDisabled', { cacheDisabled: true });
  await cdp.send('Network.emulateNetworkConditions', { offline: false, latency: 20, downloadThroughput: 10e6 / 8, uploadThroughput: 10e6 / 8 });
  const begun = performance.now();
  await page.goto(url);
  await page.locator('tr[data-axis="feeder"]').waitFor();
  const took = performance.now() - begun;
  console.log(`first values after ${took.toFixed(0)} ms`);
  assert.ok(took < 1500, `${took.toFixed(0)} ms`);
  await opened.close();
});
