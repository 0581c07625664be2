// The lane to the gateway: one WebSocket, kept open while the page is looked at. What is sent while it is closed fails at
// once: nothing waits here, so that nothing arrives late.
import { signal } from '@preact/signals';
import { decodeAnswer, encodeRequest, Kind, type Answer } from './frame';

export interface Socket {
  binaryType: string;
  readonly bufferedAmount: number;
  send(bytes: Uint8Array): void;
  close(): void;
  onopen: (() => void) | null;
  onclose: (() => void) | null;
  onmessage: ((event: { data: unknown }) => void) | null;
}

/** What the lane needs of the world; tests hand in their own. */
export interface World {
  open(): Socket;
  now(): number;
  later(milliseconds: number, run: () => void): unknown;
  cancel(handle: unknown): void;
}

export class LaneClosed extends Error {
  constructor() { super('the lane is closed'); }
}

interface Waiting { sent: number; echo: boolean; returned: boolean; resolve(answer: Answer): void; reject(error: Error): void }

const ECHO_EVERY = 1000;
const FIRST_PAUSE = 200;
const LONGEST_PAUSE = 2000;

export class Lane {
  readonly state = signal<'off' | 'opening' | 'open'>('off');
  /** Milliseconds of the last echo; null: none came back yet. */
  readonly roundTrip = signal<number | null>(null);
  private socket: Socket | null = null;
  private readonly waiting = new Map<number, Waiting>();
  private nextId = 1;
  private pause = FIRST_PAUSE;
  private wanted = false;
  private timer: unknown = null;
  private readonly closed = new Set<() => void>();

  constructor(private readonly world: World) {}

  /** Opens it, and keeps it open. */
  start(): void {
    if (this.wanted) return;
    this.wanted = true;
    this.open();
  }

  /** Closes it: the gateway halts what is jogged over it. */
  stop(): void {
    this.wanted = false;
    this.world.cancel(this.timer);
    this.socket?.close();
    this.lost();
  }

  /** Calls back whenever the lane is lost. */
  onLost(run: () => void): () => void {
    this.closed.add(run);
    return () => this.closed.delete(run);
  }

  /** How long the lane takes now: the last echo, or longer where one is awaited for longer. Infinite: it is closed. */
  takes(): number {
    if (this.state.value !== 'open') return Infinity;
    let longest = this.roundTrip.value ?? 0;
    const now = this.world.now();
    for (const { sent, echo } of this.waiting.values()) if (echo) longest = Math.max(longest, now - sent);
    return longest;
  }

  /** Sends a request at once, or throws LaneClosed. */
  call(method: string, message: Uint8Array): Promise<Answer> {
    return this.send(method, message);
  }

  private send(method: string, message: Uint8Array, returned = false): Promise<Answer> {
    const socket = this.socket;
    if (socket === null || this.state.value !== 'open') return Promise.reject(new LaneClosed());
    const id = this.nextId;
    this.nextId = (this.nextId + 1) >>> 0 || 1;
    const sent = this.world.now();
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { sent, echo: method === '', returned, resolve, reject });
      socket.send(encodeRequest(id, sent, method, message));
    });
  }

  private open(): void {
    this.state.value = 'opening';
    const socket = this.world.open();
    this.socket = socket;
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => {
      if (this.socket !== socket) return;
      this.pause = FIRST_PAUSE;
      this.state.value = 'open';
      this.echo();
    };
    socket.onmessage = ({ data }) => {
      if (this.socket !== socket || !(data instanceof ArrayBuffer)) return;
      const answer = decodeAnswer(new Uint8Array(data));
      if (answer !== null) this.answered(answer);
    };
    socket.onclose = () => { if (this.socket === socket) this.lost(); };
  }

  private answered(answer: Answer): void {
    const waiting = this.waiting.get(answer.id);
    if (waiting === undefined) return;
    this.waiting.delete(answer.id);
    if (answer.kind === Kind.echo) {
      this.roundTrip.value = this.world.now() - waiting.sent;
      // Its number comes back at once: by that the gateway knows how old messages are, and takes presses.
      if (!waiting.returned && answer.response.length > 0) this.send('', answer.response, true).catch(() => {});
    }
    waiting.resolve(answer);
  }

  private echo(): void {
    if (this.state.value !== 'open') return;
    const open = [...this.waiting.values()].some(({ echo }) => echo);
    if (!open) this.send('', new Uint8Array()).catch(() => {});
    this.timer = this.world.later(ECHO_EVERY, () => this.echo());
  }

  private lost(): void {
    this.world.cancel(this.timer);
    this.socket = null;
    this.state.value = this.wanted ? 'opening' : 'off';
    this.roundTrip.value = null;
    const waiting = [...this.waiting.values()];
    this.waiting.clear();
    for (const { reject } of waiting) reject(new LaneClosed());
    for (const run of [...this.closed]) run();
    if (!this.wanted) return;
    this.timer = this.world.later(this.pause, () => { if (this.wanted) this.open(); });
    this.pause = Math.min(this.pause * 2, LONGEST_PAUSE);
  }
}

/** The browser's own. */
export function browserWorld(url: string): World {
  return {
    open: () => new WebSocket(url, 'axisd-lane-1') as unknown as Socket,
    now: () => performance.now(),
    later: (milliseconds, run) => setTimeout(run, milliseconds),
    cancel: (handle) => clearTimeout(handle as number | undefined),
  };
}
