// The language of the page. English is part of the page, the others are fetched when somebody reads them.
import { computed, signal } from '@preact/signals';
import { en } from './en';

export type Key = keyof typeof en;
export type Texts = { readonly [key in Key]: string };
export type Language = 'en' | 'de' | 'zh';

export const languages: readonly { code: Language; name: string }[] = [
  { code: 'en', name: 'English' }, { code: 'de', name: 'Deutsch' }, { code: 'zh', name: '中文' }];

const loaders: { [code in Language]: () => Promise<Texts> } = {
  en: async () => en,
  de: async () => (await import('./de')).de,
  zh: async () => (await import('./zh')).zh,
};

export const language = signal<Language>('en');
const texts = signal<Texts>(en);

/** Reads the texts of a language, and then shows them. */
export async function setLanguage(code: Language): Promise<void> {
  const loaded = await loaders[code]();
  texts.value = loaded;
  language.value = code;
  if (typeof document !== 'undefined') document.documentElement.lang = code === 'zh' ? 'zh-Hans' : code;
}

export function isLanguage(code: string): code is Language {
  return languages.some((known) => known.code === code);
}

/** The text of a key; {name} in it is one of the values. */
export function t(key: Key, values?: { readonly [name: string]: string | number }): string {
  const text = texts.value[key];
  return values === undefined ? text : text.replace(/\{(\w+)\}/g, (whole, name: string) => String(values[name] ?? whole));
}

/** Times of day, in the language's own way. */
export const clockFormat = computed(() => new Intl.DateTimeFormat(language.value === 'zh' ? 'zh-CN' : language.value === 'de' ? 'de-DE' : 'en-GB',
  { hour: '2-digit', minute: '2-digit', second: '2-digit', hour12: false }));
