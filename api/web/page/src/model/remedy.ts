// What leads out of a refusal: for each reason the button that belongs beside its text.
import { Reason, type ErrorDetail } from '@proto/error_pb';

export type Remedy =
  | { act: 'home' | 'enable' | 'reset' | 'halt' | 'release-all' | 'release-hold' | 'take-control' | 'reconnect' | 'accept-state' }
  | { act: 'show'; screen: 'buses' | 'terminals' | 'people' | 'events' }
  | { act: 'use'; field: 'position' | 'velocity'; value: number };

/** The value within a permitted range that is nearest to what was asked, with so few digits that people can read it. */
export function nearest(asked: number, minimum: number, maximum: number): number {
  const value = Math.min(maximum, Math.max(minimum, asked));
  const grain = 10_000;
  const rounded = Math.round(value * grain) / grain;
  if (rounded < minimum) return Math.ceil(minimum * grain) / grain;
  return rounded > maximum ? Math.floor(maximum * grain) / grain : rounded;
}

/** What was asked for. `base`: `position` is a distance from there. `held`: a stop is held. */
export interface Asked { position?: number; velocity?: number; held?: boolean; base?: number }

/** A distance that ends within a range of positions, in hundredths: the base may waver by a count or two. */
export function nearestDistance(asked: number, base: number, minimum: number, maximum: number): number {
  return Math.trunc(Math.min(maximum - base, Math.max(minimum - base, asked)) * 100) / 100;
}

/** Null: time, or somebody at the machine, has to do it; the text says what. */
export function remedyOf(detail: ErrorDetail, asked: Asked): Remedy | null {
  switch (detail.reason) {
    case Reason.NOT_TRUSTED: return { act: 'home' };
    case Reason.DISABLED: return { act: 'enable' };
    case Reason.FAULT: case Reason.ALARM: case Reason.DID_NOT_START: case Reason.NOT_REACHED: case Reason.TOOK_TOO_LONG:
    case Reason.NOT_CONFIRMED: case Reason.REBOOTED: return { act: 'reset' };
    case Reason.INHIBITED: return { act: 'release-all' };
    case Reason.STOPPING: return asked.held ? { act: 'release-hold' } : null;
    case Reason.MOVING: return { act: 'halt' };
    case Reason.LEASE_REQUIRED: case Reason.LEASE_LOST: return { act: 'take-control' };
    case Reason.OFFLINE: case Reason.BUS_DOWN: case Reason.CONFIGURING: case Reason.NO_REPLY: case Reason.WRONG_MODEL:
      return { act: 'show', screen: 'buses' };
    case Reason.LIMIT_SWITCH: case Reason.TERMINAL: case Reason.MISCONFIGURED: return { act: 'show', screen: 'terminals' };
    case Reason.ACCESS_DENIED: return { act: 'show', screen: 'people' };
    case Reason.STATE_UNACCEPTED: return { act: 'accept-state' };
    case Reason.SUPERSEDED: case Reason.BUSY: case Reason.STORAGE: return { act: 'show', screen: 'events' };
    case Reason.SOFT_LIMIT: case Reason.OUT_OF_RANGE: {
      const { permitted } = detail;
      if (permitted === undefined) return null;
      const velocity = permitted.unit.endsWith('/s');
      const value = velocity ? asked.velocity : asked.position;
      if (value === undefined || permitted.unit === 'ms') return null;
      const { minimum, maximum } = permitted;
      if (!velocity && asked.base !== undefined) return { act: 'use', field: 'position', value: nearestDistance(value, asked.base, minimum, maximum) };
      return { act: 'use', field: velocity ? 'velocity' : 'position', value: nearest(value, minimum, maximum) };
    }
    default: return null;
  }
}
