// A gateway of several machines.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import type { Browser } from 'playwright-core';
import { assertReachable, closeAll, launch, open, ready, until, violations } from './support';

let browser: Browser;
before(async () => { browser = await launch(); });
after(() => closeAll(browser));

test('several machines on a panel: everything is in reach', async () => {
  const opened = await open(browser, { panel: true, width: 1280, height: 800, touch: true });
  opened.gateway.machines = [{ name: 'press-1', trouble: '' }, { name: 'press-2', trouble: '' }];
  await opened.page.goto(`${opened.url}/`);
  await opened.page.locator('tr[data-machine="press-2"]', { hasText: '6 axes' }).waitFor();
  await assertReachable(opened.page, 'machines');
  await opened.close();
});

test('several machines: a list of them, and of each its own page; STOP ALL of the list is for all of them', async () => {
  const opened = await open(browser);
  const { page, gateway, url } = opened;
  await page.locator('tr[data-axis="feeder"]').waitFor();
  gateway.machines = [{ name: 'press-1', trouble: '' }, { name: 'press-2', trouble: 'axisd does not answer at press-2:7443' }];
  await page.goto(`${url}/?lang=en&panel=0`);
  await page.locator('tr[data-machine="press-1"]', { hasText: '6 axes · 1 in error stop · 1 offline' }).waitFor();
  await page.locator('tr[data-machine="press-2"]', { hasText: 'axisd does not answer at press-2:7443' }).waitFor();
  assert.deepEqual(await violations(page), []);
  assert.equal(gateway.world.streams, 0, 'nothing is watched before a machine is chosen');
  await page.locator('tr[data-machine="press-1"] a').click();
  await page.locator('tr[data-axis="feeder"]').waitFor();
  assert.equal(new URL(page.url()).pathname, '/@press-1/machine');
  await page.locator('tr[data-axis="feeder"] a').click();
  await page.locator('.axis-head').waitFor();
  assert.equal(new URL(page.url()).pathname, '/@press-1/axis/feeder');
  await ready(page);
  assert.deepEqual([...gateway.askedOf], ['', 'press-1'], 'the first page knew of one machine');
  await page.locator('header a[href="/"]').click();
  await page.locator('tr[data-machine="press-1"]').waitFor();
  await until(() => gateway.machine.leases.size === 0, 'control does not go along');
  await page.locator('.stops [data-stop="all"]').click();
  await until(() => gateway.askedOf.has('press-2') && gateway.machine.inhibitedBy !== '', 'every machine is asked, also one that was silent');
  // An address that leads to another machine.
  gateway.machines = [{ name: 'press-2', trouble: '' }];
  await page.goto(`${url}/@press-2/axis/feeder`);
  await page.locator('.controls .reasons', { hasText: 'This page is of press-2, and what answers is press-1' }).waitFor();
  gateway.machines = [{ name: 'press-1', trouble: '' }];
  await page.goto(`${url}/@press-9/machine`);
  await page.locator('tr[data-machine="press-1"]').waitFor();
  await opened.close();
});
