// Keeps a stream open while somebody looks at the page and there is a session.
import { effect, signal, type ReadonlySignal } from '@preact/signals';

export type StreamState = 'off' | 'connecting' | 'live' | 'lost';

const FIRST_PAUSE = 200;
const LONGEST_PAUSE = 3000;

export interface Stream {
  state: ReadonlySignal<StreamState>;
  /** Of the last end; empty: it never ended by an error. */
  why: ReadonlySignal<unknown>;
  /** Begins anew at once. */
  retry(): void;
}

/** `run` reads until it ends or fails; it calls `live` with each message. It is called again, with growing pauses, while
 * `wanted`. Without a message for `silence` ms it is begun anew. */
export function keepOpen(wanted: ReadonlySignal<boolean>, run: (signal: AbortSignal, live: () => void) => Promise<void>,
                         options: { silence?: number; failed?: (error: unknown) => void } = {}): Stream {
  const state = signal<StreamState>('off');
  const why = signal<unknown>(undefined);
  let attempt = 0;
  let controller: AbortController | null = null;
  let pause = FIRST_PAUSE;
  let timer: ReturnType<typeof setTimeout> | undefined;
  let watch: ReturnType<typeof setTimeout> | undefined;

  const guard = (own: AbortController) => {
    clearTimeout(watch);
    if (options.silence !== undefined) watch = setTimeout(() => own.abort(new Error('silent')), options.silence);
  };
  const begin = async () => {
    clearTimeout(timer);
    controller?.abort();
    const own = new AbortController();
    controller = own;
    const mine = ++attempt;
    if (state.peek() !== 'lost') state.value = 'connecting';
    // A browser out of connections keeps the request: its silence counts like any other.
    guard(own);
    try {
      await run(own.signal, () => {
        if (mine !== attempt) return;
        pause = FIRST_PAUSE;
        state.value = 'live';
        guard(own);
      });
    } catch (error) {
      if (mine !== attempt) return;
      why.value = own.signal.aborted ? own.signal.reason : error;
      options.failed?.(error);
    }
    if (mine !== attempt) return;
    clearTimeout(watch);
    state.value = 'lost';
    timer = setTimeout(begin, pause);
    pause = Math.min(pause * 2, LONGEST_PAUSE);
  };
  const end = () => {
    attempt += 1;
    clearTimeout(timer);
    clearTimeout(watch);
    controller?.abort();
    controller = null;
    state.value = 'off';
  };
  effect(() => {
    const on = wanted.value;
    // The rest is no dependency of this effect.
    queueMicrotask(() => {
      if (on !== wanted.peek()) return;
      if (on && controller === null) { pause = FIRST_PAUSE; void begin(); }
      if (!on && controller !== null) end();
    });
  });
  return { state, why, retry: () => { if (wanted.peek()) { pause = FIRST_PAUSE; void begin(); } } };
}
