// A gateway that is made up: it serves the built page and the contract, over the machine of this process. What a test of the
// page alone needs; whatever concerns motion is tested against the real one.
import { createServer, type IncomingMessage, type Server, type ServerResponse } from 'node:http';
import { existsSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import type { AddressInfo, Socket } from 'node:net';
import { create, fromBinary, toBinary } from '@bufbuild/protobuf';
import { createConnectRouter } from '@connectrpc/connect';
import { Role } from '@proto/access_pb';
import { AxisService } from '@proto/axis_service_pb';
import { ErrorDetailSchema, StatusDetailsSchema } from '@proto/error_pb';
import { CommandKind } from '@proto/types_pb';
import { FakeMachine, models, Refused } from './machine';
import type { Model } from './axis';
import { laneOnlyPaths, serve, type LaneCalls, type World } from './services';
import { ServerSocket } from './socket';

const types: { [ending: string]: string } = { html: 'text/html; charset=utf-8', js: 'text/javascript', css: 'text/css', svg: 'image/svg+xml' };
const CSP = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

export interface LaneEntry { at: number; method: string }

export class MockGateway {
  readonly machine: FakeMachine;
  readonly world: World;
  /** What came over the lane. */
  readonly lane: LaneEntry[] = [];
  /** Milliseconds that the lane takes for each message. */
  laneDelay = 0;
  /** Null: everybody is let in. */
  password: string | null = null;
  /** Requests that asked for anything. */
  readonly requests: string[] = [];
  /** Several machines, which are all this one. */
  machines: { name: string; trouble: string }[] = [];
  /** Whom the calls were for. */
  readonly askedOf = new Set<string>();
  private signedIn = false;
  private readonly server: Server;
  private readonly sockets = new Set<Socket>();
  private readonly lanes = new Set<ServerSocket>();
  private readonly handlers;
  private readonly laneCalls: LaneCalls;

  constructor(private readonly files: string, axes: readonly Model[] = models) {
    this.machine = new FakeMachine(axes);
    this.world = { machine: this.machine, role: Role.MAINTAINER, streams: 0, silent: false };
    const router = createConnectRouter({ grpcWeb: true, grpc: false, connect: false });
    this.laneCalls = serve(router, this.world);
    this.handlers = new Map(router.handlers.map((handler) => [handler.requestPath, handler]));
    this.server = createServer((request, response) => void this.answer(request, response).catch(() => response.destroy()));
    this.server.on('connection', (socket) => { this.sockets.add(socket); socket.on('close', () => this.sockets.delete(socket)); });
    this.server.on('upgrade', (request, stream) => {
      if (!/^\/lane(\?machine=[a-z0-9-]+)?$/.test(request.url!) || !this.allowed()) { stream.destroy(); return; }
      this.openLane(new ServerSocket(stream, request, 'axisd-lane-1'));
    });
  }

  async listen(port = 0): Promise<string> {
    await new Promise<void>((resolve) => this.server.listen(port, '127.0.0.1', resolve));
    return `http://localhost:${(this.server.address() as AddressInfo).port}`;
  }

  /** Ends every connection, as a gateway that was killed. */
  async close(): Promise<void> {
    this.machine.close();
    for (const socket of this.sockets) socket.destroy();
    await new Promise((resolve) => this.server.close(resolve));
  }

  closeLanes(): void { for (const lane of [...this.lanes]) lane.close(); }

  private allowed(): boolean { return this.password === null || this.signedIn; }

  private async answer(request: IncomingMessage, response: ServerResponse): Promise<void> {
    const path = request.url!.split('?')[0]!;
    this.requests.push(path);
    if (path === '/session') return this.session(request, response);
    if (request.method === 'POST') return this.call(path, request, response);
    const file = path.includes('.') ? path : '/index.html';
    const whole = join(this.files, file);
    if (!existsSync(whole)) { response.writeHead(404).end(); return; }
    response.writeHead(200, { 'content-type': types[file.split('.').pop()!] ?? 'application/octet-stream', 'content-security-policy': CSP,
                              'content-encoding': 'gzip', 'cache-control': 'no-cache' }).end(readFileSync(`${whole}.gz`));
  }

  private async session(request: IncomingMessage, response: ServerResponse): Promise<void> {
    if (request.method === 'POST') {
      const chunks: Buffer[] = [];
      for await (const chunk of request) chunks.push(chunk as Buffer);
      const given = JSON.parse(Buffer.concat(chunks).toString()) as { password: string };
      if (given.password !== this.password) {
        response.writeHead(401, { 'content-type': 'application/json' }).end(JSON.stringify({ reason: 'wrong', message: 'wrong name or password', retry_after_ms: 1000 }));
        return;
      }
      this.signedIn = true;
      response.writeHead(204).end();
    } else if (request.method === 'DELETE') {
      this.signedIn = false;
      response.writeHead(204).end();
    } else if (!this.allowed()) response.writeHead(401).end();
    else {
      const how = this.password === null ? 'loopback' : 'password';
      response.writeHead(200, { 'content-type': 'application/json' }).end(JSON.stringify({ name: 'shift-a', how, expires_in_s: 3600, ...(this.machines.length > 0 ? { machines: this.machines } : {}) }));
    }
  }

  private async call(path: string, request: IncomingMessage, response: ServerResponse): Promise<void> {
    const handler = this.handlers.get(path);
    if (handler === undefined || laneOnlyPaths.has(path.slice(1))) { response.writeHead(404).end(); return; }
    if (request.headers['content-type'] !== 'application/grpc-web+proto') { response.writeHead(415).end(); return; }
    if (!this.allowed()) { response.writeHead(401, { 'content-type': 'application/grpc-web+proto', 'grpc-status': '16' }).end(); return; }
    this.askedOf.add(String(request.headers['axisd-machine'] ?? ''));
    const gone = new AbortController();
    response.on('close', () => gone.abort());
    const header = new Headers();
    for (const [name, value] of Object.entries(request.headers)) if (typeof value === 'string') header.set(name, value);
    const answer = await handler({ httpVersion: '1.1', method: 'POST', url: `http://localhost${path}`, header, body: request, signal: gone.signal, contextValues: undefined as never });
    response.writeHead(answer.status, Object.fromEntries(answer.header ?? new Headers()));
    if (answer.body !== undefined) for await (const chunk of answer.body as AsyncIterable<Uint8Array>) response.write(chunk);
    response.end();
  }

  private openLane(socket: ServerSocket): void {
    this.lanes.add(socket);
    const jogged = new Set<string>();
    const queue: Uint8Array[] = [];
    socket.onmessage = (message) => {
      queue.push(message);
      const next = () => { const first = queue.shift(); if (first !== undefined) socket.send(this.carryOut(first, jogged)); };
      if (this.laneDelay === 0) next(); else setTimeout(next, this.laneDelay);
    };
    socket.onclose = () => {
      this.lanes.delete(socket);
      for (const axis of jogged) if (this.machine.axis(axis).jogUntil !== 0) this.machine.stop(axis, CommandKind.HALT);
    };
  }

  private carryOut(message: Uint8Array, jogged: Set<string>): Uint8Array {
    const view = new DataView(message.buffer, message.byteOffset, message.byteLength);
    const id = view.getUint32(1);
    const length = view.getUint8(9);
    const method = new TextDecoder().decode(message.subarray(10, 10 + length));
    if (length === 0) return answered(3, id, 0, '', new Uint8Array(), new Uint8Array(8).fill(7));
    this.lane.push({ at: performance.now(), method });
    const body = message.subarray(10 + length);
    if (method === 'axisd.v1.AxisService/Jog') jogged.add(fromBinary(AxisService.method.jog.input, body).axis);
    const carry = this.laneCalls.get(method);
    if (carry === undefined) return answered(4, id, 12, `${method} does not go by the lane`, new Uint8Array(), new Uint8Array());
    try {
      return answered(1, id, 0, '', new Uint8Array(), carry(body));
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      const details = toBinary(StatusDetailsSchema, create(StatusDetailsSchema, { code: error.code, message: error.rawMessage, details: [
        { typeUrl: 'type.googleapis.com/axisd.v1.ErrorDetail', value: toBinary(ErrorDetailSchema, error.detail) }] }));
      return answered(1, id, error.code, error.rawMessage, details, new Uint8Array());
    }
  }
}

function answered(kind: number, id: number, status: number, message: string, details: Uint8Array, response: Uint8Array): Uint8Array {
  const text = new TextEncoder().encode(message);
  const bytes = new Uint8Array(12 + text.length + details.length + response.length);
  const view = new DataView(bytes.buffer);
  view.setUint8(0, kind);
  view.setUint32(1, id);
  view.setUint8(5, status);
  view.setUint16(6, text.length);
  bytes.set(text, 8);
  view.setUint32(8 + text.length, details.length);
  bytes.set(details, 12 + text.length);
  bytes.set(response, 12 + text.length + details.length);
  return bytes;
}
