// What came of the last things that were asked for. A click never ends in silence.
import { signal } from '@preact/signals';
import type { Key } from '../i18n';

/** A text in the language of the page, or one of the daemon, which stays as it is. */
export type Text = { key: Key; values?: { [name: string]: string | number } } | { plain: string };

export interface Notice { id: number; level: 'done' | 'busy' | 'warning' | 'error'; at: Date; text: Text; more?: string }

export const notices = signal<readonly Notice[]>([]);
const MOST = 4;
let nextId = 1;

/** Shows it; gives its number, by which `settle` puts another in its place. */
export function notify(level: Notice['level'], text: Text, more?: string): number {
  const id = nextId++;
  const notice: Notice = { id, level, at: new Date(), text, ...(more ? { more } : {}) };
  notices.value = [notice, ...notices.peek()].slice(0, MOST);
  return id;
}

export function settle(id: number, level: Notice['level'], text: Text, more?: string): void {
  notices.value = notices.peek().map((notice) =>
    notice.id === id ? { id, level, at: new Date(), text, ...(more ? { more } : {}) } : notice);
}

export function dismiss(id: number): void {
  notices.value = notices.peek().filter((notice) => notice.id !== id);
}
