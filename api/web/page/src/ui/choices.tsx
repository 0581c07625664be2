import type { ComponentChildren } from 'preact';
import { language, languages, setLanguage, t } from '../i18n';
import { panel, theme, type Theme } from '../settings';

/** Some buttons, of which one is chosen. */
export function Choice<T extends string>({ label, value, options, pick }:
    { label: string; value: T; options: readonly { id: T; name: ComponentChildren; lang?: string }[]; pick: (id: T) => void }) {
  return (
    <div class="choice" role="group" aria-label={label}>
      {options.map(({ id, name, lang }) => (
        <button key={id} type="button" class="button" lang={lang} aria-pressed={id === value} onClick={() => pick(id)}>{name}</button>
      ))}
    </div>
  );
}

export function LanguageChoice() {
  return <Choice label={t('settings.language')} value={language.value} pick={(code) => void setLanguage(code)}
                 options={languages.map(({ code, name }) => ({ id: code, name, lang: code }))} />;
}

export function ThemeChoice() {
  const options: { id: Theme; name: string }[] = [
    { id: 'auto', name: t('settings.auto') }, { id: 'light', name: t('settings.light') }, { id: 'dark', name: t('settings.dark') }];
  return <Choice label={t('settings.theme')} value={theme.value} options={options} pick={(id) => { theme.value = id; }} />;
}

export function PanelChoice() {
  return <Choice label={t('settings.size')} value={panel.value ? 'panel' : 'desk'} pick={(id) => { panel.value = id === 'panel'; }}
                 options={[{ id: 'desk', name: t('settings.desk') }, { id: 'panel', name: t('settings.panel') }]} />;
}
