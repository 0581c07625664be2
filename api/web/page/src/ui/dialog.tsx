// Questions and the keypad: beside the screen, never over the stops.
import { signal } from '@preact/signals';
import type { ComponentChildren } from 'preact';
import { useEffect, useRef } from 'preact/hooks';
import { t } from '../i18n';
import { ifMeant } from './meant';

interface Open { title: string; body: ComponentChildren; wide?: boolean }

const open = signal<Open | null>(null);
let opener: Element | null = null;

export function ask(dialog: Open): void {
  opener ??= document.activeElement;
  open.value = dialog;
}

export function closeDialog(): void {
  open.value = null;
  if (opener instanceof HTMLElement) opener.focus();
  opener = null;
}

/** A question with one way to go on. */
export function confirmed(title: string, text: string, action: string, run: () => void): void {
  ask({ title, body: <>
    <p>{text}</p>
    <div class="row end">
      <button class="button" onClick={closeDialog}>{t('action.cancel')}</button>
      <button class="button primary" onClick={ifMeant(() => { closeDialog(); run(); })}>{action}</button>
    </div>
  </> });
}

export function Dialog() {
  const card = useRef<HTMLDivElement>(null);
  const shown = open.value;
  useEffect(() => {
    if (shown !== null) (card.current?.querySelector<HTMLElement>('button, input') ?? card.current)?.focus();
  }, [shown]);
  if (shown === null) return null;
  return (
    <div class="veil" onPointerDown={(event) => { if (event.target === event.currentTarget) closeDialog(); }}>
      <div class="dialog" role="dialog" aria-label={shown.title} ref={card} tabIndex={-1}
           onKeyDown={(event) => { if (event.key === 'Escape') { event.stopPropagation(); closeDialog(); } }}>
        <h2>{shown.title}</h2>
        {shown.body}
      </div>
    </div>
  );
}
