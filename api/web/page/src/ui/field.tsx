// A number that somebody types: by the keyboard, or on a panel by the page's own keypad.
import { signal, type Signal } from '@preact/signals';
import { t } from '../i18n';
import { keyed, typed } from '../model/numbers';
import { panel } from '../settings';
import { ask, closeDialog } from './dialog';

const keys = ['7', '8', '9', 'back', '4', '5', '6', 'clear', '1', '2', '3', 'sign', '0', '.', 'ok'];

function Keypad({ value, label, unit }: { value: Signal<string>; label: string; unit: string }) {
  const text = draft.value;
  const good = text === '' || typed(text) !== null;
  const words: { [key: string]: [string, string] } = {
    back: ['⌫', t('keypad.back')], clear: ['C', t('keypad.clear')], sign: ['±', t('keypad.sign')], ok: [t('keypad.ok'), t('keypad.ok')] };
  return (
    <div class="keypad">
      <output aria-label={label}>{text === '' ? ' ' : text}<span class="unit">{unit}</span></output>
      <div class="keys">
        {keys.map((key) => (
          <button key={key} class={`button key key-${key === '.' ? 'point' : key} ${key === 'ok' ? 'primary' : ''}`}
                  aria-label={words[key]?.[1] ?? key} aria-disabled={key === 'ok' && !good}
                  onClick={() => {
                    if (key !== 'ok') draft.value = keyed(text, key);
                    else if (good) { value.value = text; closeDialog(); }
                  }}>
            {words[key]?.[0] ?? key}
          </button>
        ))}
      </div>
    </div>
  );
}

const draft = signal('');

export function NumberField({ value, label, unit, width = 7 }: { value: Signal<string>; label: string; unit: string; width?: number }) {
  const bad = value.value !== '' && typed(value.value) === null;
  const pick = () => {
    if (!panel.peek()) return;
    draft.value = '';
    ask({ title: label, body: <Keypad value={value} label={label} unit={unit} /> });
  };
  return (
    <label class={`field ${bad ? 'bad' : ''}`}>
      <span class="caption">{label}</span>
      <span class="box">
        <input type="text" inputMode={panel.value ? 'none' : 'decimal'} readOnly={panel.value} value={value.value} size={width}
               autocomplete="off" aria-invalid={bad} onInput={(event) => { value.value = event.currentTarget.value; }} onClick={pick}
               onKeyDown={(event) => { if (panel.peek() && (event.key === 'Enter' || event.key === ' ')) { event.preventDefault(); pick(); } }} />
        <span class="unit">{unit}</span>
      </span>
    </label>
  );
}
