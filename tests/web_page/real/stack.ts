// A real daemon with simulated drives, the real gateway in front of it, and between that and the browser a network that a
// test can cut.
import { execFile, spawn, type ChildProcess } from 'node:child_process';
import { appendFileSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { createServer, connect, type AddressInfo, type Server, type Socket } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { promisify } from 'node:util';

const run = promisify(execFile);

export interface Truth { position: number; moving: boolean; starts: number }

async function freePort(): Promise<number> {
  const server = createServer();
  await new Promise<void>((resolve) => server.listen(0, '127.0.0.1', resolve));
  const { port } = server.address() as AddressInfo;
  await new Promise((resolve) => server.close(resolve));
  return port;
}

/** A machine of many axes on simulated lines of 20, which turn endlessly. */
export function manyAxes(count: number): (demo: string) => string {
  return (demo) => {
    const head = demo.slice(0, demo.indexOf('\nbuses:'));
    const lines = Array.from({ length: Math.ceil(count / 20) }, (_, line) =>
      `  line-${line}:\n    modbus_rtu: { port: sim, baud: 115200, format: 8N1, turnaround_max: 20 ms }\n`);
    const axes = Array.from({ length: count }, (_, axis) =>
      `  axis-${axis}:\n    bus: line-${Math.floor(axis / 20)}\n    node: ${axis % 20 + 1}\n    model: ykd2405pr\n    unit: deg\n` +
      '    scale: { microstep: 4000 pulses/rev, gear: 10/1 }\n    limits: { velocity: 180 deg/s, acceleration_time: 300 ms }\n');
    return `${head}\nbuses:\n${lines.join('')}axes:\n${axes.join('')}`;
  };
}

/** What a tap hears: a message of the stream of states, as it goes by. */
export type Tap = (message: Uint8Array) => void;

/** Finds the messages in the chunked answer to one request. */
class States {
  private bytes = Buffer.alloc(0);
  private inBody = false;

  constructor(private readonly wanted = false) {}

  hear(data: Buffer, tap: Tap | null): void {
    if (!this.wanted) return;
    this.bytes = Buffer.concat([this.bytes, data]);
    if (!this.inBody) {
      const end = this.bytes.indexOf('\r\n\r\n');
      if (end < 0) return;
      this.bytes = this.bytes.subarray(end + 4);
      this.inBody = true;
    }
    for (;;) {
      const line = this.bytes.indexOf('\r\n');
      if (line < 0) return;
      const size = parseInt(this.bytes.toString('latin1', 0, line), 16);
      if (this.bytes.length < line + 2 + size + 2) return;
      const frame = this.bytes.subarray(line + 2, line + 2 + size);
      // One frame a chunk, as the gateway sends them; the last one has trailers.
      if (frame[0] === 0) tap?.(frame.subarray(5));
      this.bytes = this.bytes.subarray(line + 2 + size + 2);
    }
  }
}

/** Passes bytes on, unless it is cut; looks into what goes up on the lane. */
export class Network {
  /** When each message of a method went up, by performance.now(). */
  readonly sent: { at: number; method: string }[] = [];
  /** Null: nobody listens. */
  tap: Tap | null = null;
  private isCut = false;
  private readonly pairs = new Set<[Socket, Socket]>();
  private server!: Server;

  constructor(private readonly target: number) {}

  async listen(): Promise<number> {
    this.server = createServer((near) => {
      const far = connect(this.target, '127.0.0.1');
      const pair: [Socket, Socket] = [near, far];
      this.pairs.add(pair);
      if (this.isCut) pair.forEach((socket) => socket.pause());
      for (const socket of pair) socket.setNoDelay(true);
      let buffered: Buffer<ArrayBuffer> = Buffer.alloc(0);
      let lane = false;
      let states = new States();
      near.on('data', (data) => {
        far.write(data);
        if (data.toString('latin1', 0, 64).startsWith('POST ')) states = new States(/WatchAxes/.test(data.toString('latin1', 0, 64)));
        if (!lane) { lane = data.toString('latin1').startsWith('GET /lane'); return; }
        buffered = this.look(Buffer.concat([buffered, data]));
      });
      far.on('data', (data) => {
        states.hear(data, this.tap);
        near.write(data);
      });
      for (const [one, other] of [[near, far], [far, near]] as const) {
        one.on('error', () => other.destroy());
        one.on('close', () => { other.destroy(); this.pairs.delete(pair); });
      }
    });
    await new Promise<void>((resolve) => this.server.listen(0, '127.0.0.1', resolve));
    return (this.server.address() as AddressInfo).port;
  }

  /** Nothing gets through, and nothing is lost: as a radio link does. */
  cut(): void { this.isCut = true; for (const pair of this.pairs) pair.forEach((socket) => socket.pause()); }
  join(): void { this.isCut = false; for (const pair of this.pairs) pair.forEach((socket) => socket.resume()); }

  close(): void {
    for (const pair of this.pairs) pair.forEach((socket) => socket.destroy());
    this.server.close();
  }

  lastOf(method: string): number { return this.sent.filter((message) => message.method.endsWith(method)).at(-1)?.at ?? NaN; }

  private look(bytes: Buffer<ArrayBuffer>): Buffer<ArrayBuffer> {
    for (;;) {
      if (bytes.length < 6) return bytes;
      let length = bytes[1]! & 127;
      let at = 2;
      if (length === 126) { if (bytes.length < 8) return bytes; length = bytes.readUInt16BE(2); at = 4; }
      if (bytes.length < at + 4 + length) return bytes;
      const mask = bytes.subarray(at, at + 4);
      const message = Buffer.from(bytes.subarray(at + 4, at + 4 + length));
      for (let index = 0; index < length; ++index) message[index]! ^= mask[index % 4]!;
      if ((bytes[0]! & 15) === 2 && message.length > 10) {
        this.sent.push({ at: performance.now(), method: message.subarray(10, 10 + message[9]!).toString('latin1') });
      }
      bytes = bytes.subarray(at + 4 + length);
    }
  }
}

const needed = (name: string): string => process.env[name] ?? (() => { throw new Error(`${name} is not set`); })();

export const CHROMIUM = process.env['AXISD_CHROMIUM'] ?? '/usr/bin/chromium';
export const sleep = (ms: number) => new Promise<void>((resolve) => setTimeout(resolve, ms));

/** Waits until something holds; how long that took. */
export async function until(holds: () => Promise<boolean>, what: string, atMost: number): Promise<number> {
  const begun = performance.now();
  while (!(await holds())) {
    if (performance.now() - begun > atMost) throw new Error(`not within ${atMost} ms: ${what}`);
    await sleep(5);
  }
  return performance.now() - begun;
}

export class Stack {
  readonly folder = mkdtempSync(join(tmpdir(), 'axisd-web-real-'));
  url = '';
  network!: Network;
  private server = '';
  private port = 0;
  private daemon: ChildProcess | null = null;
  private gateway: ChildProcess | null = null;

  private readonly programs = { axisd: needed('AXISD'), web: needed('AXISD_WEB'), axisctl: needed('AXISCTL'), page: needed('AXISD_WEB_PAGE'),
                                demo: needed('AXISD_DEMO') };

  /** `change`: of the demo's configuration; `web`: lines of the gateway's. */
  async start(change: (yaml: string) => string = (yaml) => yaml, web = ''): Promise<void> {
    const port = await freePort();
    this.server = `127.0.0.1:${port}`;
    const demo = readFileSync(this.programs.demo, 'utf8')
      .replace('state_directory: /tmp/axisd-demo', `state_directory: ${join(this.folder, 'state')}`)
      .replace('listen: localhost:7443', `listen: 127.0.0.1:${port}\n  stop_listen: 127.0.0.1:${await freePort()}`);
    writeFileSync(join(this.folder, 'axisd.yaml'), change(demo));
    this.port = await freePort();
    writeFileSync(join(this.folder, 'users'), '', { mode: 0o600 });  // nobody: whoever is at this computer is let in
    const stop = /stop_listen: ([\d.]+:\d+)/.exec(demo)![1]!;
    writeFileSync(join(this.folder, 'web.yaml'),
                  `listen: localhost:${this.port}\naxisd: { server: "${this.server}", stop_server: "${stop}" }\nfiles: ${this.programs.page}\nusers: ${join(this.folder, 'users')}\n${web}`);
    this.startDaemon();
    await this.answers();
    await this.startGateway();
    this.network = new Network(this.port);
    this.url = `http://localhost:${await this.network.listen()}`;
  }

  startDaemon(): void { this.daemon = this.program(this.programs.axisd, ['--config', join(this.folder, 'axisd.yaml')], 'axisd.log'); }

  async startGateway(): Promise<void> {
    this.gateway = this.program(this.programs.web, ['--config', join(this.folder, 'web.yaml')], 'web.log');
    let said = '';
    for (let tries = 0; tries < 200; ++tries) {
      const answer = await fetch(`http://localhost:${this.port}/session`).catch(() => null);
      if (answer?.ok) return;
      said = (await answer?.text()) ?? 'nothing';
      await new Promise((resolve) => setTimeout(resolve, 50));
    }
    throw new Error(`axisd-web is not ready: ${said} ${readFileSync(join(this.folder, 'web.log'), 'utf8')}`);
  }

  /** Where it is, without a network between. */
  get gatewayPort(): number { return this.port; }
  get gatewayPid(): number { return this.gateway!.pid!; }

  /** What it has to be asked with (AXISD_SERVER). */
  get address(): string { return this.server; }

  /** Waits until all axes are there. */
  async answers(): Promise<void> {
    for (let tries = 0; tries < 100; ++tries) {
      const text = await this.axisctl('list').catch(() => '');
      if (/turntable|axis-0/.test(text) && !/configuring|offline/.test(text)) return;
      await new Promise((resolve) => setTimeout(resolve, 100));
    }
    throw new Error(`axisd does not answer: ${readFileSync(join(this.folder, 'axisd.log'), 'utf8')}`);
  }

  async killDaemon(): Promise<void> { await this.ended(this.daemon!, 'SIGKILL'); }
  async killGateway(): Promise<void> { await this.ended(this.gateway!, 'SIGKILL'); }
  signalGateway(signal: NodeJS.Signals): void { this.gateway!.kill(signal); }

  async axisctl(...words: string[]): Promise<string> {
    return (await run(this.programs.axisctl, words, { env: { ...process.env, AXISD_SERVER: this.server }, timeout: 15_000 })).stdout;
  }

  /** Where the load really is. */
  async truth(axis: string): Promise<Truth> {
    const { reply } = JSON.parse(await this.axisctl('sim', 'show', axis, '--json')) as { reply: string };
    const [, position, motion, starts] = /at (-?[\d.e+-]+) \w+, (moving|at rest), (\d+) starts/.exec(reply) ?? [];
    if (position === undefined) throw new Error(reply);
    return { position: Number(position), moving: motion === 'moving', starts: Number(starts) };
  }

  async close(): Promise<void> {
    this.network?.close();
    for (const program of [this.gateway, this.daemon]) if (program !== null) await this.ended(program, 'SIGKILL').catch(() => {});
    rmSync(this.folder, { recursive: true, force: true });
  }

  private program(path: string, words: string[], log: string): ChildProcess {
    const child = spawn(path, words, { stdio: ['ignore', 'pipe', 'pipe'], env: { ...process.env } });
    const keep = (data: Buffer) => appendFileSync(join(this.folder, log), data);
    child.stdout!.on('data', keep);
    child.stderr!.on('data', keep);
    writeFileSync(join(this.folder, log), '');
    return child;
  }

  private async ended(child: ChildProcess, signal: NodeJS.Signals): Promise<void> {
    if (child.exitCode !== null || child.signalCode !== null) return;
    const over = new Promise((resolve) => child.once('exit', resolve));
    child.kill('SIGCONT');
    child.kill(signal);
    await over;
  }
}

