// Whatever cannot be used now says why with the words of the daemon's refusal, and what leads out is a button beside it.
import assert from 'node:assert/strict';
import { createRequire } from 'node:module';
import { copyFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, afterEach, before, test } from 'node:test';
import type { Browser, Page } from 'playwright-core';
import { fromBinary } from '@bufbuild/protobuf';
import { AcquireLeaseResponseSchema } from '@proto/lease_service_pb';
import { CHROMIUM, Stack, until } from './stack';

const { chromium } = createRequire(process.env['AXISD_WEB_MODULES']!)('playwright-core') as typeof import('playwright-core');

let stack: Stack;
let browser: Browser;

/** The turntable does not back off from its switch, and the dial cannot be homed. */
function changed(yaml: string): string {
  const cut = (text: string, begin: string, end: string): string => {
    const from = text.indexOf(begin);
    return text.slice(0, from) + text.slice(text.indexOf(end, from));
  };
  const turntable = yaml.indexOf('  turntable:');
  const dial = yaml.indexOf('  dial:');
  return yaml.slice(0, turntable) + cut(yaml.slice(turntable, dial), '      backoff:', '      max_travel:')
    + cut(yaml.slice(dial), '    homing:', '    inputs:');
}

before(async () => {
  stack = new Stack();
  await stack.start(changed);
  copyFileSync(join(stack.folder, 'state', 'state.v1'), join(stack.folder, 'older'));
  browser = await chromium.launch({ executablePath: CHROMIUM, args: ['--no-sandbox', '--disable-gpu'] });
});
after(async () => {
  await browser?.close().catch(() => {});
  await stack?.close();
});
afterEach(async () => { for (const context of browser.contexts()) await context.close().catch(() => {}); });

/** A page that has control of what it shows, and its token. Whoever is at this computer is the same client. */
class Controlled {
  private token = '';
  private constructor(readonly page: Page, private readonly path: string) {}

  static async open(path: string): Promise<Controlled> {
    const context = await browser.newContext({ viewport: { width: 1440, height: 900 } });
    const opened = new Controlled(await context.newPage(), path);
    await opened.page.route('**/AcquireLease', async (route) => {
      const response = await route.fetch();
      const body = await response.body();
      if (body[0] === 0) opened.token = String(fromBinary(AcquireLeaseResponseSchema, body.subarray(5, 5 + body.readUInt32BE(1))).leaseToken);
      await route.fulfill({ response, body });
    });
    await opened.page.goto(`${stack.url}${path}?panel=0&lang=en`);
    await opened.take();
    return opened;
  }

  async take(): Promise<void> {
    this.token = '';
    await this.page.locator('[data-act="take-control"]').first().click();
    await until(async () => {
      // The page of another test, which is closed, may have had it.
      if (await this.page.locator('.dialog .primary').count() > 0) await this.page.locator('.dialog .primary').click();
      return this.token !== '';
    }, 'the page has control', 5000);
  }

  /** Enables the axis, unless it is. */
  async on(): Promise<void> {
    await this.page.locator('[data-act="enable"], [data-act="disable"]').first().waitFor();
    if (await this.page.locator('[data-act="enable"]').count() > 0) await this.page.locator('[data-act="enable"]:not([aria-disabled="true"])').click();
    await this.page.locator('[data-act="disable"]').waitFor();
  }

  /** The line that says what is in the way of a button. */
  line(label: string, text: RegExp) {
    return this.page.locator('.reasons li').filter({ has: this.page.locator('.what', { hasText: label }) })
      .filter({ has: this.page.locator('[data-explain]', { hasText: text }) });
  }

  field(index: number) { return this.page.locator('.controls .move input').nth(index); }

  async mode(how: 'to' | 'by'): Promise<void> { await this.page.locator('.controls .choice .button', { hasText: how }).click(); }

  /** With which words the daemon refuses a command that this page might give. */
  async refusal(...words: string[]): Promise<string> {
    return stack.axisctl(...words, '--lease', this.token).then(() => '', (error: { stderr: string }) => error.stderr);
  }

  /** The button says what the command line is refused with; the remedy is there, and with it the reason goes. */
  async leadsOut(what: string, label: string, text: RegExp, words: string[], remedy: string, help: () => Promise<unknown> = async () => {}): Promise<void> {
    const line = this.line(label, text);
    await line.first().waitFor();
    // The command line tells the address in between.
    const refused = async () => (await this.refusal(...words)).replace(/line-\w+ node \d+: /, '');
    let said = '';
    let shown: string[] = [];
    // Both change: with the value that was typed, with what is asked of a drive in vain.
    await until(async () => {
      said = await refused();
      assert.match(said, text, what);
      shown = await line.locator('[data-explain]').allTextContents();
      return shown.length === 1 && said.includes(shown[0]!);
    }, `${what}: what is said`, 5000).catch((error: Error) => { throw new Error(`${error.message}: ${said} Shown: ${shown.join(' | ')}`); });
    await line.locator(`[data-remedy="${remedy}"]`).click();
    if (remedy === 'show') {
      await until(async () => new URL(this.page.url()).pathname !== this.path, `${what}: another screen`, 3000);
      await help();
      await this.page.goBack();
    } else await help();
    await until(async () => await line.count() === 0, `${what}: the reason is gone`, 20_000);
    seen += 1;
  }

  async confirm(): Promise<void> { await this.page.locator('.dialog .primary').click(); }
}

let seen = 0;
const online = (axis: string) => until(async () => (await stack.axisctl('state', axis, '--json')).includes('LINK_STATE_ONLINE'), `${axis} is online`, 20_000);

test('an axis that is off, and not homed', async () => {
  const at = await Controlled.open('/axis/pusher');
  await at.field(0).fill('50');
  const off = /power stage is off/;
  for (const [label, words] of [['Home', ['home', 'pusher']], ['Jog +', ['jog', 'pusher', '5mm/s']], ['Move', ['move', 'pusher', '50mm']]] as const) {
    await at.leadsOut(`off: ${label}`, label, off, [...words], 'enable', () => at.page.locator('[data-act="disable"]').waitFor());
    await at.page.locator('[data-act="disable"]').click();
    await at.line('Home', off).waitFor();
  }
  await at.on();
  await at.mode('by');
  const lost = /position is unknown/;
  await at.leadsOut('not homed, by', 'Move', lost, ['move', 'pusher', '--relative', '50mm'], 'home', () => until(
    async () => /POSITION_TRUST_HOMED/.test(await stack.axisctl('state', 'pusher', '--json')) && !(await stack.truth('pusher')).moving, 'it is homed', 20_000));
});

test('targets, distances and velocities beyond what is permitted', async () => {
  const at = await Controlled.open('/axis/pusher');
  await at.on();
  const beyond = /beyond a software limit/;
  for (const target of ['500', '-20']) {
    await at.field(0).fill(target);
    await at.leadsOut(`target ${target}`, 'Move', beyond, ['move', 'pusher', `${target}mm`], 'use');
  }
  await at.field(0).fill('50');
  for (const velocity of ['900', '0.01']) {
    await at.field(1).fill(velocity);
    await at.leadsOut(`velocity ${velocity}`, 'Move', /velocity/, ['move', 'pusher', '50mm', '--velocity', `${velocity}mm/s`], 'use');
  }
  await at.field(1).fill('');
  await at.mode('by');
  await at.field(0).fill('400');
  await at.leadsOut('distance', 'Move', beyond, ['move', 'pusher', '--relative', '400mm'], 'use');
  await at.page.locator('.jog-pad input').fill('900');
  await at.leadsOut('jog', 'Jog +', /velocity/, ['jog', 'pusher', '900mm/s'], 'use');
  // A relative move needs standstill.
  await at.field(0).fill('5');
  assert.equal(await at.refusal('move', 'pusher', '140mm', '--velocity', '5mm/s'), '');
  await at.leadsOut('while it moves', 'Move', /needs standstill/, ['move', 'pusher', '--relative', '5mm'], 'halt');
});

test('limit switches, held stops, STOP ALL', async () => {
  const at = await Controlled.open('/axis/pusher');
  await at.on();
  await at.field(0).fill('140');
  const limit = /positive limit switch is active/;
  for (const [label, words] of [['Jog +', ['jog', 'pusher', '5mm/s']], ['Move', ['move', 'pusher', '140mm']]] as const) {
    await stack.axisctl('sim', 'input', 'pusher', 'X1', 'on');
    await at.leadsOut(`limit: ${label}`, label, limit, [...words], 'show', () => stack.axisctl('sim', 'input', 'pusher', 'X1', 'auto'));
    await at.field(0).fill('140');
  }
  await stack.axisctl('stop', 'pusher', '--hold');
  await at.leadsOut('held', 'Home', /a stop is held by/, ['home', 'pusher'], 'release-hold', () => at.confirm());
  await stack.axisctl('stop', '--all');
  await at.leadsOut('STOP ALL', 'Home', /StopAll holds the machine/, ['home', 'pusher'], 'release-all', () => at.confirm());
});

test('alarms, supplies, cables', async () => {
  const at = await Controlled.open('/axis/pusher');
  await stack.axisctl('sim', 'alarm', 'pusher', '2');
  await at.line('Home', /in ErrorStop/).waitFor();
  await stack.axisctl('sim', 'alarm', 'pusher', '0');
  await at.leadsOut('alarm', 'Home', /in ErrorStop/, ['home', 'pusher'], 'reset');
  await stack.axisctl('sim', 'power', 'pusher', 'off');
  await at.leadsOut('no supply', 'Home', /offline/, ['home', 'pusher'], 'show', async () => {
    await stack.axisctl('sim', 'power', 'pusher', 'on');
    await online('pusher');
  });
  const dial = await Controlled.open('/axis/dial');
  await stack.axisctl('sim', 'cut', 'line-b');
  await dial.leadsOut('cable', 'Home', /offline/, ['home', 'dial'], 'show', async () => {
    await stack.axisctl('sim', 'join', 'line-b');
    await online('dial');
  });
});

test('what an axis is not configured for, and what nobody can help from here', async () => {
  const dial = await Controlled.open('/axis/dial');
  await dial.on();
  const line = dial.line('Home', /no homing is configured/);
  await line.waitFor();
  assert.match(await dial.refusal('home', 'dial'), /no homing is configured/);
  assert.equal(await line.locator('[data-remedy]').count(), 0);
  assert.match((await line.textContent())!, /add homing: to the axis in the YAML/);
  await dial.page.locator('[data-act="disable"]').click();
  const at = await Controlled.open('/axis/turntable');
  await at.on();
  await stack.axisctl('sim', 'input', 'turntable', 'X0', 'on');
  await at.leadsOut('on the switch', 'Home', /switch is already active/, ['home', 'turntable'], 'show',
                    () => stack.axisctl('sim', 'input', 'turntable', 'X0', 'auto'));
});

test('a member of a group, and what the daemon remembers', async () => {
  await stack.axisctl('disable', 'feeder', '--wait');
  const group = await Controlled.open('/groups');
  await group.page.locator('.members input').first().fill('60');
  await group.leadsOut('member', 'Move', /feeder: .*power stage is off/, ['group', 'move', 'transfer', 'feeder=60mm'], 'enable');
  await stack.killDaemon();
  copyFileSync(join(stack.folder, 'older'), join(stack.folder, 'state', 'state.v1'));
  stack.startDaemon();
  await stack.answers();
  const at = await Controlled.open('/axis/feeder');
  await at.leadsOut('what is remembered', 'Home', /state\.v1 was rolled back/, ['home', 'feeder'], 'accept-state', () => at.confirm());
});

test('these were twenty situations', () => {
  console.log(`# ${seen} situations`);
  assert.ok(seen >= 20, `${seen}`);
});
