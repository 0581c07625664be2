// Somebody who only claims to be a page, in a process of its own: node bad_input.mjs PORT KIND SECONDS. Prints how often.
import { connect, type Socket } from 'node:net';
import { randomBytes } from 'node:crypto';

const [port, kind, seconds] = [Number(process.argv[2]), process.argv[3]!, Number(process.argv[4])];
const end = performance.now() + seconds * 1000;
let sent = 0;

const MIB = Buffer.alloc(1 << 20);
const frame = (body: Buffer, said = body.length) => { const head = Buffer.alloc(5); head.writeUInt32BE(said, 1); return Buffer.concat([head, body]); };
const post = (path: string, body: Buffer, more = '') => Buffer.concat([Buffer.from(
  `POST ${path} HTTP/1.1\r\nHost: localhost:${port}\r\nOrigin: http://localhost:${port}\r\nContent-Type: application/grpc-web+proto\r\n${more}Content-Length: ${body.length}\r\n\r\n`), body]);

/** Ten thousand echoes of a page, as fast as they are taken. */
const ECHO = Buffer.concat([Buffer.from([0x82, 0x8a, 0, 0, 0, 0, 1]), Buffer.alloc(9)]);
const lane = Buffer.concat([Buffer.from(
  `GET /lane HTTP/1.1\r\nHost: localhost:${port}\r\nOrigin: http://localhost:${port}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n` +
  `Sec-WebSocket-Protocol: axisd-lane-1\r\nSec-WebSocket-Key: ${randomBytes(16).toString('base64')}\r\n\r\n`), ...Array.from({ length: 10_000 }, () => ECHO)]);

const KINDS: { [kind: string]: () => Buffer } = {
  garbage: () => randomBytes(4096),
  'TLS hello': () => Buffer.concat([Buffer.from([0x16, 3, 1, 2, 0, 1, 0, 1, 0xfc, 3, 3]), randomBytes(500)]),
  'half a frame': () => post('/axisd.v1.AxisService/GetAxis', frame(randomBytes(20), 100)),
  'body of 1 MiB': () => post('/axisd.v1.AxisService/GetAxis', frame(MIB)),
  'unknown method': () => post('/axisd.v1.AxisService/Nothing', frame(Buffer.alloc(0))),
  'no message': () => post('/axisd.v1.AxisService/GetAxis', frame(randomBytes(60))),
  'forged user': () => post('/axisd.v1.AxisService/GetAxis', frame(Buffer.alloc(0)), 'axisd-user: maintainer\r\naxisd-role: maintainer\r\n'),
  '10,000 lane messages': () => lane,
};

/** One connection after the other, each of which says it once and is gone when it is answered or cut off. */
function once(): Promise<void> {
  return new Promise((resolve) => {
    const socket: Socket = connect(port, 'localhost');
    const over = () => { socket.destroy(); resolve(); };
    socket.setTimeout(1000, over);
    socket.on('connect', () => { socket.write(KINDS[kind]!()); sent += 1; });
    if (kind === '10,000 lane messages') socket.resume(); else socket.once('data', over);
    socket.on('error', () => {});
    socket.on('close', over);
  });
}

await Promise.all(Array.from({ length: 8 }, async () => { while (performance.now() < end) await once(); }));
console.log(sent);
process.exit(0);
