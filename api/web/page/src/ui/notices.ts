// What came of the last things that were asked for. A click never ends in silence.
import { signal } from '@preact/signals';
import type { Key } from '../i18n';

/** A text in the language of the page, or one of the daemon, which stays as it is. */
export type Text = { key: Key; values?: { [name: string]: string | number } } | { plain: string };

export interface Notice { id: number; level: 'done' | 'busy' | 'warning' | 'error'; at: Date; text: Text; more?: string }

export const notices = signal<readonly Notice[]>([]);
const MOST = 4;
/** What went well is read once. What did not stays until something else is said, or somebody closes it. */
const DONE_MS = 8000;
let nextId = 1;

function leave(id: number, level: Notice['level']): void {
  if (level === 'done') setTimeout(() => dismiss(id), DONE_MS);
}

/** Shows it; gives its number, by which `settle` puts another in its place. */
export function notify(level: Notice['level'], text: Text, more?: string): number {
  const id = nextId++;
  const notice: Notice = { id, level, at: new Date(), text, ...(more ? { more } : {}) };
  notices.value = [notice, ...notices.peek()].slice(0, MOST);
  leave(id, level);
  return id;
}

export function settle(id: number, level: Notice['level'], text: Text, more?: string): void {
  notices.value = notices.peek().map((notice) =>
    notice.id === id ? { id, level, at: new Date(), text, ...(more ? { more } : {}) } : notice);
  leave(id, level);
}

export function dismiss(id: number): void {
  notices.value = notices.peek().filter((notice) => notice.id !== id);
}
