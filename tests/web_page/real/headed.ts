// A browser with windows, on a screen of its own, and nothing between it and a test: Playwright has each page take itself for
// seen and focused, whatever covers it.
import { spawn, type ChildProcess } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { CHROMIUM } from './stack';

type Params = { [name: string]: unknown };
interface Waiting { resolve(result: Params): void; reject(error: Error): void }

export class Tab {
  constructor(private readonly browser: Headed, private readonly target: string, private readonly session: string) {}

  send(method: string, params: Params = {}): Promise<Params> { return this.browser.send(method, params, this.session); }

  /** The value of an expression in the page, also where it is promised. */
  async value<T>(expression: string): Promise<T> {
    const { result, exceptionDetails } = await this.send('Runtime.evaluate', { expression, awaitPromise: true, returnByValue: true });
    if (exceptionDetails !== undefined) throw new Error(JSON.stringify(exceptionDetails));
    return (result as { value: T }).value;
  }

  /** Comes to the front of its window: whatever was there is hidden. */
  async show(): Promise<void> { await this.browser.send('Target.activateTarget', { targetId: this.target }); }
}

export class Headed {
  private readonly folder = mkdtempSync(join(tmpdir(), 'axisd-headed-'));
  private readonly waiting = new Map<number, Waiting>();
  private readonly programs: ChildProcess[] = [];
  private input!: NodeJS.WritableStream;
  private last = 0;
  private heard = '';

  async start(): Promise<void> {
    const browser = spawn(CHROMIUM, ['--no-sandbox', '--disable-gpu', '--no-first-run', '--remote-debugging-pipe', '--window-size=1440,1000',
                                     `--user-data-dir=${this.folder}`, 'about:blank'],
                          { stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe'], env: { ...process.env, DISPLAY: await this.screen() } });
    this.programs.push(browser);
    this.input = browser.stdio[3] as NodeJS.WritableStream;
    (browser.stdio[4] as NodeJS.ReadableStream).on('data', (data: Buffer) => this.hear(data.toString('utf8')));
    browser.once('exit', () => { for (const { reject } of this.waiting.values()) reject(new Error('the browser has ended')); });
  }

  async close(): Promise<void> {
    for (const program of this.programs.reverse()) {
      if (program.exitCode !== null || program.signalCode !== null) continue;
      const over = new Promise((resolve) => program.once('exit', resolve));
      program.kill();
      await over;
    }
    rmSync(this.folder, { recursive: true, force: true, maxRetries: 5 });
  }

  async open(url: string): Promise<Tab> {
    const { targetId } = await this.send('Target.createTarget', { url }) as { targetId: string };
    const { sessionId } = await this.send('Target.attachToTarget', { targetId, flatten: true }) as { sessionId: string };
    return new Tab(this, targetId, sessionId);
  }

  send(method: string, params: Params, sessionId?: string): Promise<Params> {
    const id = ++this.last;
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { resolve, reject });
      this.input.write(`${JSON.stringify({ id, method, params, ...(sessionId === undefined ? {} : { sessionId }) })}\0`);
    });
  }

  private hear(text: string): void {
    const messages = (this.heard + text).split('\0');
    this.heard = messages.pop()!;
    for (const message of messages) {
      const { id, result, error } = JSON.parse(message) as { id?: number; result?: Params; error?: { message: string } };
      const waiting = id === undefined ? undefined : this.waiting.get(id);
      if (waiting === undefined) continue;
      this.waiting.delete(id!);
      if (error === undefined) waiting.resolve(result!);
      else waiting.reject(new Error(error.message));
    }
  }

  /** Starts an X server without a screen; the name of its display. */
  private screen(): Promise<string> {
    const server = spawn('Xvfb', ['-displayfd', '3', '-screen', '0', '1600x1100x24', '-nolisten', 'tcp'], { stdio: ['ignore', 'ignore', 'ignore', 'pipe'] });
    this.programs.push(server);
    return new Promise((resolve, reject) => {
      server.once('error', reject);
      server.once('exit', (code) => reject(new Error(`Xvfb ended: ${code}`)));
      (server.stdio[3] as NodeJS.ReadableStream).once('data', (number: Buffer) => resolve(`:${number.toString().trim()}`));
    });
  }
}
