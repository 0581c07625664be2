// Buttons that say why they cannot be used, with what leads out beside them.
import type { ComponentChildren } from 'preact';
import { acceptState, askRelease, askReleaseAll, askTakeControl } from './questions';
import { states } from '../app';
import type { Obstacle } from '../explain';
import { t, type Key } from '../i18n';
import type { Remedy } from '../model/remedy';
import { decimals, shown } from '../model/numbers';
import { enable, home, reset } from '../motion';
import { go } from '../route';
import { haltAxis } from '../stops';
import { ifMeant } from './meant';

export interface Act { id: string; label: string; obstacle: Obstacle | null }

/** A button that stays in reach of the keyboard while it cannot be used: its reason is read with it. */
export function ActButton({ act, run, primary, children }:
    { act: Act; run: () => void; primary?: boolean; children?: ComponentChildren }) {
  const blocked = act.obstacle !== null;
  return (
    <button class={`button ${primary && !blocked ? 'primary' : ''}`} aria-disabled={blocked} data-act={act.id}
            aria-describedby={blocked ? describedBy(act) : undefined} onClick={ifMeant(() => { if (!blocked) run(); })}>
      {children ?? act.label}
    </button>
  );
}

/** The same reason has one line, whatever it is in the way of. */
export const describedBy = ({ obstacle }: Act): string =>
  `why-${[...`${obstacle?.text}`].reduce((hash, letter) => (hash * 31 + letter.charCodeAt(0)) | 0, 7) >>> 0}`;

const remedyWords: { [act: string]: Key } = {
  home: 'action.home', enable: 'action.enable', reset: 'action.reset', halt: 'action.halt', 'release-all': 'action.release-all',
  'release-hold': 'action.release-hold', 'take-control': 'action.take-control', reconnect: 'action.reconnect',
  'accept-state': 'action.accept-state',
};

export interface Use { field: 'position' | 'velocity'; value: number }

function remedyLabel(remedy: Remedy, unit: string): string {
  if (remedy.act === 'show') return t(`nav.${remedy.screen}`);
  if (remedy.act === 'use') {
    return t('action.use', { value: `${shown(remedy.value, decimals(unit))} ${remedy.field === 'velocity' ? `${unit}/s` : unit}` });
  }
  return t(remedyWords[remedy.act]!);
}

export function RemedyButton({ remedy, axis, axes, unit, use }:
    { remedy: Remedy; axis: string; axes?: readonly string[]; unit: string; use?: (value: Use) => void }) {
  const run = () => {
    switch (remedy.act) {
      case 'home': void home(axis); break;
      case 'enable': void enable(axis); break;
      case 'reset': void reset(axis); break;
      case 'halt': void haltAxis(axis); break;
      case 'release-all': askReleaseAll(); break;
      case 'release-hold': askRelease(axis); break;
      case 'take-control': void askTakeControl(axes ?? [axis]); break;
      case 'reconnect': states.retry(); break;
      case 'accept-state': acceptState(); break;
      case 'show': go(remedy.screen, remedy.screen === 'terminals' ? axis : ''); break;
      case 'use': use?.(remedy); break;
    }
  };
  return <button class="button remedy" data-remedy={remedy.act} onClick={ifMeant(run)}>{remedyLabel(remedy, unit)}</button>;
}

/** The reasons of some buttons, each once, naming the buttons that it keeps from being used. */
export function Explanations({ acts, axis, axes, unit, use }:
    { acts: readonly Act[]; axis: string; axes?: readonly string[]; unit: string; use?: (value: Use, act: Act) => void }) {
  const groups = new Map<string, { labels: string[]; act: Act }>();
  for (const act of acts) {
    if (act.obstacle === null) continue;
    const group = groups.get(act.obstacle.text);
    if (group === undefined) groups.set(act.obstacle.text, { labels: [act.label], act });
    else if (!group.labels.includes(act.label)) group.labels.push(act.label);
  }
  const known = new Set(['home', 'enable', 'reset', 'take-control', 'release-all']);
  return (
    <ul class="reasons" aria-live="polite">
      {[...groups.values()].map(({ labels, act }) => {
        const { word, text, remedy, hint } = act.obstacle!;
        // A remedy that is in the way itself leads nowhere: what is in its way is told in its own line.
        const inTheWay = remedy !== null && known.has(remedy.act) && acts.some(({ id, obstacle }) => id === remedy.act && obstacle !== null);
        return (
          <li key={text} id={describedBy(act)}>
            <span class="what">{labels.join(', ')}</span>
            <span class="text">{word !== '' && <b>{word}. </b>}<span data-explain="">{text}</span>{remedy === null && hint !== '' && <i> {hint}</i>}</span>
            {remedy !== null && !inTheWay && <RemedyButton remedy={remedy} axis={axis} unit={unit} {...(axes ? { axes } : {})} {...(use ? { use: (value: Use) => use(value, act) } : {})} />}
          </li>
        );
      })}
    </ul>
  );
}
