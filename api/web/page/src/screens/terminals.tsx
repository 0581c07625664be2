// The inputs and outputs of every drive, as they were last read.
import type { Terminal } from '@proto/types_pb';
import { store } from '../app';
import { t } from '../i18n';
import { ageText } from '../model/numbers';
import { go, route } from '../route';
import { useEffect } from 'preact/hooks';

function Lamp({ terminal, stale }: { terminal: Terminal; stale: boolean }) {
  const { name, active, function: of } = terminal;
  return (
    <li class={`lamp ${active ? 'on' : 'off'} ${stale ? 'stale' : ''}`}>
      <svg viewBox="0 0 16 16" class="mark" aria-hidden="true">
        <circle cx="8" cy="8" r="6" fill={active ? 'currentColor' : 'none'} stroke="currentColor" stroke-width="2" /></svg>
      <b>{name}</b><span class="function">{of === '' ? '-' : of}</span><span class="value">{active ? t('terminal.on') : t('terminal.off')}</span>
    </li>
  );
}

function AxisTerminals({ name }: { name: string }) {
  const entry = store.axis(name);
  if (entry === undefined) return null;
  const { inputs, outputs } = entry.state.value;
  const stale = entry.stale.value;
  return (
    <section class="card terminals" id={`terminals-${name}`} aria-label={name}>
      <h2><a href={`/axis/${name}`} onClick={(event) => { event.preventDefault(); go('axis', name); }}>{name}</a>
        {stale && ' '}{stale && <small class="old">{Number.isFinite(entry.age.value) ? t('live.old', { age: ageText(entry.age.value) }) : t('link.offline')}</small>}</h2>
      <h3>{t('terminal.inputs')}</h3>
      <ul class="lamps">{inputs.map((terminal) => <Lamp key={terminal.name} terminal={terminal} stale={stale} />)}</ul>
      <h3>{t('terminal.outputs')}</h3>
      <ul class="lamps">{outputs.map((terminal) => <Lamp key={terminal.name} terminal={terminal} stale={stale} />)}</ul>
    </section>
  );
}

export function TerminalsScreen() {
  const { of } = route.value;
  useEffect(() => { if (of !== '') document.getElementById(`terminals-${of}`)?.scrollIntoView(); }, [of]);
  return (
    <>
      <p class="hint">{t('terminal.hint')}</p>
      <div class="grid">{store.names.value.map((name) => <AxisTerminals key={name} name={name} />)}</div>
    </>
  );
}
