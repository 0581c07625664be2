// Events in words.
import { InhibitChangeKind, LeaseChangeKind, StopHoldChangeKind, type Event } from '@proto/event_service_pb';
import { t } from '../i18n';
import { linkKey, reasonKey, stateKey } from '../i18n/names';

const word = (key: ReturnType<typeof stateKey>): string => (key === null ? '?' : t(key));

export function eventText({ content }: Event): string {
  switch (content.case) {
    case 'terminalEdge': {
      const { terminal, function: of, active } = content.value;
      return t(active ? 'event.active' : 'event.inactive', { terminal: of === '' ? terminal : `${terminal} ${of}` });
    }
    case 'stateChange': return `${word(stateKey(content.value.from))} → ${word(stateKey(content.value.to))}`;
    case 'linkChange': return `${word(linkKey(content.value.to))}${content.value.detail === '' ? '' : `: ${content.value.detail}`}`;
    case 'configurationDrift': return content.value.text === '' ? t('event.drift-over') : t('event.drift', { text: content.value.text });
    case 'flightRecord': return t('event.flight-record', { name: content.value.name, reason: content.value.reason });
    case 'leaseChange': {
      const { kind, holder, before } = content.value;
      if (kind === LeaseChangeKind.ACQUIRED) return t('event.lease-acquired', { who: holder });
      if (kind === LeaseChangeKind.RELEASED) return t('event.lease-released', { who: before });
      if (kind === LeaseChangeKind.EXPIRED) return t('event.lease-expired', { who: before });
      return t('event.lease-taken', { who: holder || '-', before });
    }
    case 'configurationReloaded': return t('event.reloaded', { who: content.value.client });
    case 'stopHoldChange': {
      const { kind, holder, by } = content.value;
      if (kind === StopHoldChangeKind.HELD) return t('event.held', { who: holder });
      if (kind === StopHoldChangeKind.RELEASED) return t('event.released', { who: by, holder });
      return t('event.hold-not-durable', { who: holder });
    }
    case 'axisFault': {
      const { cause } = content.value;
      const key = cause === undefined ? null : reasonKey(cause.reason);
      return `${key === null ? t('state.error-stop') : t(key)}: ${cause?.message ?? ''}`;
    }
    case 'keptStateChange': {
      const { convictions, acceptedBy } = content.value;
      return acceptedBy === '' ? t('event.state-doubtful', { text: convictions.map(({ text }) => text).join('; ') })
        : t('event.state-accepted', { who: acceptedBy });
    }
    case 'inhibitChange': {
      const { kind, by } = content.value;
      if (kind === InhibitChangeKind.RELEASED) return t('event.inhibit-released', { who: by });
      if (kind === InhibitChangeKind.STANDS) return t('event.inhibit-stands', { who: by });
      if (kind === InhibitChangeKind.NOT_DURABLE) return t('event.inhibit-not-durable');
      return t('event.inhibit', { who: by });
    }
    case 'certificateNotice': return content.value.text;
    case 'eepromWritten':
      return t('event.eeprom', { registers: String(content.value.registers), total: String(content.value.total) });
    case 'commandChange': return '';
    default: return '?';
  }
}
