// What is known of an axis, in words.
import { LinkState, State, type AxisState, type Command } from '@proto/types_pb';
import type { AxisEntry } from '../model/store';
import { t } from '../i18n';
import { endKey, kindKey, linkKey, stateKey, trustKey } from '../i18n/names';
import { ageText, decimals, shown, spanText } from '../model/numbers';
import { instant } from '../model/wire';

export const axesText = (count: number): string => (count === 1 ? t('head.axis') : t('head.axes', { count }));

/** "Standstill", "Offline 12 s". */
export function stateText(state: AxisState, ageMs: number): string {
  if (state.link === LinkState.OFFLINE) {
    return Number.isFinite(ageMs) && state.measuredAt !== undefined ? `${t('link.offline')} ${ageText(ageMs)}` : t('link.offline');
  }
  if (state.link === LinkState.CONFIGURING) return t(linkKey(state.link) ?? 'link.configuring');
  const key = stateKey(state.state);
  return key === null ? State[state.state] ?? '?' : t(key);
}

/** "120.000 mm"; in parentheses where it is not live, with a tilde where it cannot be trusted. */
export function positionText(state: AxisState, stale: boolean): string {
  if (state.measuredAt === undefined) return '-';
  const text = `${state.trust === 1 ? '~' : ''}${shown(state.position, decimals(state.unit))} ${state.unit}`;
  return stale ? `(${text})` : text;
}

export function velocityText(state: AxisState, stale: boolean): string {
  if (state.measuredAt === undefined) return '-';
  const text = `${shown(state.velocity, 1)} ${state.unit}/s`;
  return stale ? `(${text})` : text;
}

export function trustText(state: AxisState): string {
  const key = trustKey(state.trust);
  return key === null ? '-' : t(key);
}

/** One line about what is wrong, or worth knowing. */
export function noteText(state: AxisState): string {
  const error = state.link === LinkState.OFFLINE || state.link === LinkState.CONFIGURING ? state.linkError
    : state.state === State.ERROR_STOP ? state.fault : undefined;
  if (error !== undefined) return [error.message, error.remedy].filter(Boolean).join(': ');
  if (state.holds.length > 0) return t('note.held', { who: state.holds.map(({ holder }) => holder).join(', ') });
  if (state.enabled && !state.enabledByDaemon) return t('note.not-ours');
  return state.drift || state.alarmName || state.linkNote;
}

export function leaseText(entry: AxisEntry, mine: boolean): string {
  const { leaseHolder } = entry.state.value;
  if (mine) return t('lease.mine');
  return leaseHolder === '' ? t('lease.free') : t('lease.by', { who: leaseHolder });
}

/** "Move to 120 mm at 50 mm/s". */
export function commandText(command: Command, unit: string): string {
  const kind = kindKey(command.kind);
  const asked = command.asked;
  const parts = [kind === null ? '?' : t(kind)];
  if (asked?.position !== undefined) parts.push(`${Number(asked.position.toFixed(6))} ${unit}`);
  if (asked?.distance !== undefined) parts.push(`${asked.distance > 0 ? '+' : ''}${Number(asked.distance.toFixed(6))} ${unit}`);
  if (asked?.velocity !== undefined) parts.push(t('command.at', { velocity: `${Number(asked.velocity.toFixed(4))} ${unit}/s` }));
  return parts.join(' ');
}

export function endText(command: Command): string {
  const key = endKey(command.state);
  const begun = instant(command.startedAt ?? command.acceptedAt);
  const ended = instant(command.endedAt);
  const word = key === null ? '?' : t(key);
  return begun !== null && ended !== null ? `${word} ${spanText(Math.max(0, ended - begun))}` : word;
}
