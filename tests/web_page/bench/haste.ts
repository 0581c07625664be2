// Time that goes faster, for whoever lives by the clock and the timers of its thread or page.

/** `times` as fast, since `from` (ms since 1970) by the computer's clock. */
export interface Haste { times: number; from: number }

/** From now on. Also carried into a page as its text: it uses nothing but its argument. */
export function hurry({ times, from }: Haste): void {
  const scope = globalThis as unknown as { Date: DateConstructor; performance: Performance; setTimeout: unknown; setInterval: unknown };
  const Plain = scope.Date;
  const clock = performance.now.bind(performance);
  const later = setTimeout as (run: (...words: unknown[]) => void, milliseconds: number, ...words: unknown[]) => unknown;
  const again = setInterval as typeof later;
  const now = () => from + (Plain.now() - from) * times;
  scope.Date = class extends Plain {
    constructor(...words: []) {
      if (words.length === 0) super(now()); else super(...words);
    }
    static override now(): number { return now(); }
  } as DateConstructor;
  scope.performance.now = () => clock() * times;
  scope.setTimeout = (run: () => void, milliseconds = 0, ...words: unknown[]) => later(run, milliseconds / times, ...words);
  scope.setInterval = (run: () => void, milliseconds = 0, ...words: unknown[]) => again(run, milliseconds / times, ...words);
}
