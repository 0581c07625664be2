// Every axis of the machine, one line each.
import { useComputed } from '@preact/signals';
import { memo } from 'preact/compat';
import { store, tokenFor } from '../app';
import { t } from '../i18n';
import type { AxisEntry } from '../model/store';
import { go, hrefOf } from '../route';
import { stopAxis } from '../stops';
import { StateMark, tone } from '../ui/marks';
import { pressed } from '../ui/stop-rail';
import { leaseText, noteText, positionText, stateText, trustText, velocityText } from '../ui/words';
import { ageText } from '../model/numbers';

/** Numbers change without the row being made anew. */
const Row = memo(function Row({ entry }: { entry: AxisEntry }) {
  const { name } = entry;
  const position = useComputed(() => positionText(entry.state.value, entry.stale.value));
  const velocity = useComputed(() => velocityText(entry.state.value, entry.stale.value));
  const age = useComputed(() => (entry.stale.value && Number.isFinite(entry.age.value) ? ageText(entry.age.value) : ''));
  const look = useComputed(() => `${tone(entry.state.value)} ${entry.stale.value ? 'stale' : ''}`);
  const words = useComputed(() => stateText(entry.state.value, entry.age.value));
  const trust = useComputed(() => trustText(entry.state.value));
  const lease = useComputed(() => leaseText(entry, tokenFor(name) !== 0n));
  const note = useComputed(() => noteText(entry.state.value));
  return (
    <tr class={look} data-axis={name}>
      <th scope="row"><a href={hrefOf('axis', name)} onClick={(event) => { event.preventDefault(); go('axis', name); }}>{name}</a></th>
      <td class="state"><span class="badge"><RowMark entry={entry} />{words}</span></td>
      <td class="number position"><b>{position}</b><small class="age">{age}</small></td>
      <td class="number velocity">{velocity}</td>
      <td class="trust">{trust}</td>
      <td class="lease">{lease}</td>
      <td class="note">{note}</td>
      <td class="act"><button class="stop small" data-stop={name} {...pressed(() => void stopAxis(name))}
                              aria-label={`${t('stop.one')} ${name}`}>{t('stop.one')}</button></td>
    </tr>
  );
});

function RowMark({ entry }: { entry: AxisEntry }) {
  const shape = useComputed(() => `${entry.state.value.state}/${entry.state.value.link}`);
  shape.value;
  return <StateMark state={entry.state.peek()} />;
}

export function MachineScreen() {
  const names = store.names.value;
  if (names.length === 0) return <p class="empty">{store.live.value ? t('page.no-axes') : t('live.connecting')}</p>;
  return (
    <table class="axes">
      <caption class="unseen">{t('nav.machine')}</caption>
      <thead><tr>
        <th scope="col">{t('column.axis')}</th><th scope="col">{t('column.state')}</th><th scope="col" class="number">{t('column.position')}</th>
        <th scope="col" class="number">{t('column.velocity')}</th><th scope="col">{t('column.trust')}</th>
        <th scope="col">{t('column.control')}</th><th scope="col">{t('column.note')}</th><th scope="col"><span class="unseen">{t('stop.one')}</span></th>
      </tr></thead>
      <tbody>{names.map((name) => {
        const entry = store.axis(name);
        return entry === undefined ? null : <Row key={name} entry={entry} />;
      })}</tbody>
    </table>
  );
}
