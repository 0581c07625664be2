// What axisd-web costs while pages watch 64 axes at 20 Hz. Here a page is what the gateway sees of one: a stream of states, a
// stream of events, a lane with an echo each second; nothing is drawn.
import { readFileSync } from 'node:fs';
import { request, type ClientRequest, type IncomingMessage } from 'node:http';
import { randomBytes } from 'node:crypto';
import type { Socket } from 'node:net';
import { create, toBinary } from '@bufbuild/protobuf';
import { WatchAxesRequestSchema } from '@proto/axis_service_pb';
import { WatchEventsRequestSchema } from '@proto/event_service_pb';
import { manyAxes, sleep, Stack } from '../real/stack';

const AXES = 64;
const SECONDS = 10;
const PERIOD_MS = 50;
const TICKS_A_SECOND = 100;  // of /proc, on Linux

/** Streams of one client that axisd and axisd-web permit here: there are more than any person's. */
const LIMITS = 'limits: { streams: 256 }';
const GATEWAY_LIMITS = 'limits: { streams: 256, streams_each: 256, connections: 256, connections_each: 256, lanes: 128, lanes_each: 128 }\n';

class FakePage {
  bytes = 0;
  batches = 0;
  private readonly requests: ClientRequest[] = [];
  private lane: Socket | null = null;
  private timer: ReturnType<typeof setInterval> | null = null;

  constructor(private readonly port: number) {}

  async open(): Promise<void> {
    await this.stream('axisd.v1.AxisService/WatchAxes',
                      toBinary(WatchAxesRequestSchema, create(WatchAxesRequestSchema, { period: { seconds: 0n, nanos: PERIOD_MS * 1e6 } })),
                      (data) => { this.bytes += data.length; this.batches += 1; });
    await this.stream('axisd.v1.EventService/WatchEvents', toBinary(WatchEventsRequestSchema, create(WatchEventsRequestSchema)), () => {});
    await this.openLane();
  }

  close(): void {
    if (this.timer !== null) clearInterval(this.timer);
    this.lane?.destroy();
    for (const one of this.requests) one.destroy();
  }

  private async stream(method: string, message: Uint8Array, hear: (data: Buffer) => void): Promise<void> {
    const frame = Buffer.alloc(5 + message.length);
    frame.writeUInt32BE(message.length, 1);
    frame.set(message, 5);
    const call = request({ host: 'localhost', port: this.port, method: 'POST', path: `/${method}`, agent: false,
                           headers: { origin: this.origin, 'content-type': 'application/grpc-web+proto', 'content-length': frame.length } });
    this.requests.push(call);
    call.on('error', () => {});
    const answer = await new Promise<IncomingMessage>((resolve, reject) => { call.once('response', resolve); call.once('error', reject); call.end(frame); });
    if (answer.statusCode !== 200) throw new Error(`${method}: ${answer.statusCode}`);
    answer.on('error', () => {});
    answer.on('data', hear);
  }

  private async openLane(): Promise<void> {
    const call = request({ host: 'localhost', port: this.port, path: '/lane', agent: false, headers: {
      origin: this.origin, connection: 'Upgrade', upgrade: 'websocket', 'sec-websocket-version': '13',
      'sec-websocket-protocol': 'axisd-lane-1', 'sec-websocket-key': randomBytes(16).toString('base64') } });
    this.lane = await new Promise<Socket>((resolve, reject) => {
      call.once('upgrade', (_, socket) => resolve(socket as Socket));
      call.once('response', ({ statusCode }) => reject(new Error(`the lane: ${statusCode}`)));
      call.once('error', reject);
      call.end();
    });
    this.lane.on('error', () => {});
    this.lane.resume();
    this.timer = setInterval(() => this.echo(), 1000);
  }

  /** A binary frame with a mask of zeros around the shortest message. */
  private echo(): void {
    const message = Buffer.alloc(10);
    message[0] = 1;
    message.writeUInt32BE(Date.now() >>> 0, 5);
    this.lane!.write(Buffer.concat([Buffer.from([0x82, 0x80 | message.length, 0, 0, 0, 0]), message]));
  }

  private get origin(): string { return `http://localhost:${this.port}`; }
}

/** Seconds of CPU time, in user mode and in the system. */
function cpuSeconds(pid: number): number {
  const words = readFileSync(`/proc/${pid}/stat`, 'utf8').split(') ')[1]!.split(' ');
  return (Number(words[11]) + Number(words[12])) / TICKS_A_SECOND;
}

const residentMib = (pid: number) => Number(/VmRSS:\s+(\d+)/.exec(readFileSync(`/proc/${pid}/status`, 'utf8'))![1]) / 1024;

/** What axisd-web may take: % of a core for one page and for each further, MiB with all of them. */
const FIRST_PAGE = 1.5;
const FURTHER_PAGE = 0.3;
const MEMORY = 40;

/** Without pages, with one, and with many. */
export async function costOfPages(): Promise<void> {
  const stack = new Stack();
  await stack.start((demo) => manyAxes(AXES)(demo).replace(/( *)reflection: .*/, `$1${LIMITS}`), GATEWAY_LIMITS);
  const pages: FakePage[] = [];
  try {
    for (const count of [0, 1, 10, 50]) {
      while (pages.length < count) {
        pages.push(new FakePage(stack.gatewayPort));
        await pages.at(-1)!.open();
      }
      await sleep(2000);
      for (const page of pages) { page.bytes = 0; page.batches = 0; }
      const [before, begun] = [cpuSeconds(stack.gatewayPid), performance.now()];
      await sleep(SECONDS * 1000);
      const seconds = (performance.now() - begun) / 1000;
      const share = (cpuSeconds(stack.gatewayPid) - before) / seconds;
      const each = (what: (page: FakePage) => number) => (count === 0 ? 0 : pages.reduce((sum, page) => sum + what(page), 0) / count / seconds);
      const most = count === 0 ? Infinity : FIRST_PAGE + (count - 1) * FURTHER_PAGE;
      if (share * 100 > most || residentMib(stack.gatewayPid) > MEMORY) {
        console.error(`beyond ${most.toFixed(1)} % or ${MEMORY} MiB`);
        process.exitCode = 1;
      }
      console.log(`${count} pages, ${AXES} axes: axisd-web ${(share * 100).toFixed(2)} % of a core, ${residentMib(stack.gatewayPid).toFixed(1)} MiB; each page ` +
                  `${each(({ batches }) => batches).toFixed(1)} batches and ${(each(({ bytes }) => bytes) / 1024).toFixed(0)} KiB a second`);
    }
  } finally {
    for (const page of pages) page.close();
    await stack.close();
  }
}
