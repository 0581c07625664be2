// Messages on the lane, the one ordered connection on which stops, jogs and lease renewals go to the gateway.

export const VERSION = 1;
export const MOST_BYTES = 16 * 1024;

/** What the gateway says of a request. */
export const Kind = { answer: 1, droppedAsLate: 2, echo: 3, refused: 4 } as const;

export interface Answer {
  kind: number;
  id: number;
  /** Status code of gRPC, 0: OK. */
  status: number;
  message: string;
  /** google.rpc.Status, as in grpc-status-details-bin; may be empty. */
  details: Uint8Array;
  response: Uint8Array;
}

/** version | id | sent_ms | n | method | message; a method without a letter asks for an echo. */
export function encodeRequest(id: number, sentMs: number, method: string, message: Uint8Array): Uint8Array {
  const name = new TextEncoder().encode(method);
  if (name.length > 255) throw new RangeError('method name too long');
  const bytes = new Uint8Array(10 + name.length + message.length);
  if (bytes.length > MOST_BYTES) throw new RangeError('message too long for the lane');
  const view = new DataView(bytes.buffer);
  view.setUint8(0, VERSION);
  view.setUint32(1, id >>> 0);
  view.setUint32(5, Math.trunc(sentMs) >>> 0);
  view.setUint8(9, name.length);
  bytes.set(name, 10);
  bytes.set(message, 10 + name.length);
  return bytes;
}

/** kind | id | status | length, message | length, details | response. Null: it is no such message. */
export function decodeAnswer(bytes: Uint8Array): Answer | null {
  if (bytes.length < 12) return null;
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const messageEnd = 8 + view.getUint16(6);
  if (bytes.length < messageEnd + 4) return null;
  const detailsEnd = messageEnd + 4 + view.getUint32(messageEnd);
  if (bytes.length < detailsEnd) return null;
  return {
    kind: view.getUint8(0), id: view.getUint32(1), status: view.getUint8(5),
    message: new TextDecoder().decode(bytes.subarray(8, messageEnd)),
    details: bytes.subarray(messageEnd + 4, detailsEnd),
    response: bytes.subarray(detailsEnd),
  };
}
