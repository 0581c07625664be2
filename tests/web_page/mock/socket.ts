// The server's half of a WebSocket (RFC 6455), as far as a test needs it.
import { createHash } from 'node:crypto';
import type { IncomingMessage } from 'node:http';
import type { Duplex } from 'node:stream';

export class ServerSocket {
  onmessage: (message: Uint8Array) => void = () => {};
  onclose: () => void = () => {};
  private buffered = Buffer.alloc(0);
  private closed = false;

  constructor(private readonly stream: Duplex, request: IncomingMessage, protocol: string) {
    const key = createHash('sha1').update(`${request.headers['sec-websocket-key']}258EAFA5-E914-47DA-95CA-C5AB0DC85B11`).digest('base64');
    stream.write(['HTTP/1.1 101 Switching Protocols', 'Upgrade: websocket', 'Connection: Upgrade', `Sec-WebSocket-Accept: ${key}`,
                  `Sec-WebSocket-Protocol: ${protocol}`, '', ''].join('\r\n'));
    stream.on('data', (data: Buffer) => this.read(data));
    stream.on('error', () => this.end());
    stream.on('close', () => this.end());
  }

  send(message: Uint8Array): void {
    if (this.closed) return;
    const head = message.length < 126 ? Buffer.from([0x82, message.length])
      : Buffer.from([0x82, 126, message.length >> 8, message.length & 255]);
    this.stream.write(Buffer.concat([head, message]));
  }

  close(): void { this.stream.destroy(); this.end(); }

  private end(): void {
    if (this.closed) return;
    this.closed = true;
    this.onclose();
  }

  private read(data: Buffer): void {
    this.buffered = Buffer.concat([this.buffered, data]);
    for (;;) {
      const { buffered } = this;
      if (buffered.length < 6) return;
      let length = buffered[1]! & 127;
      let at = 2;
      if (length === 126) {
        if (buffered.length < 8) return;
        length = buffered.readUInt16BE(2);
        at = 4;
      } else if (length === 127) { this.close(); return; }
      if (buffered.length < at + 4 + length) return;
      const mask = buffered.subarray(at, at + 4);
      const payload = Buffer.from(buffered.subarray(at + 4, at + 4 + length));
      for (let index = 0; index < length; ++index) payload[index]! ^= mask[index % 4]!;
      this.buffered = buffered.subarray(at + 4 + length);
      const kind = buffered[0]! & 15;
      if (kind === 8) { this.close(); return; }
      if (kind === 2) this.onmessage(payload);
    }
  }
}
