// How this browser shows the page: kept here, and sent nowhere.
import { effect, signal } from '@preact/signals';
import { isLanguage, language, setLanguage } from './i18n';

export type Theme = 'auto' | 'light' | 'dark';

function kept(name: string): string | null {
  try { return localStorage.getItem(`axisd.${name}`); } catch { return null; }
}

function keep(name: string, value: string): void {
  try { localStorage.setItem(`axisd.${name}`, value); } catch { /* A browser that keeps nothing shows the page all the same. */ }
}

const asked = new URLSearchParams(location.search);
const choice = (name: string) => asked.get(name) ?? kept(name);

const themeAsked = choice('theme');
export const theme = signal<Theme>(themeAsked === 'light' || themeAsked === 'dark' ? themeAsked : 'auto');
const panelAsked = choice('panel');
/** Big buttons, 1280 x 800, everything by touch. */
export const panel = signal(panelAsked === null ? matchMedia('(pointer: coarse)').matches : panelAsked !== '0');
const prefersDark = matchMedia('(prefers-color-scheme: dark)');
const systemDark = signal(prefersDark.matches);
prefersDark.addEventListener('change', ({ matches }) => { systemDark.value = matches; });
export const dark = signal(false);

export function startSettings(): void {
  effect(() => {
    dark.value = theme.value === 'dark' || (theme.value === 'auto' && systemDark.value);
    document.documentElement.dataset['theme'] = dark.value ? 'dark' : 'light';
    keep('theme', theme.value);
  });
  effect(() => {
    document.documentElement.dataset['panel'] = panel.value ? 'on' : 'off';
    keep('panel', panel.value ? '1' : '0');
  });
  const wanted = choice('lang') ?? navigator.language.slice(0, 2);
  if (isLanguage(wanted) && wanted !== 'en') void setLanguage(wanted).catch(() => {});
  let first = true;
  effect(() => {
    const code = language.value;
    if (!first) keep('lang', code);
    first = false;
  });
}
