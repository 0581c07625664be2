// What is asked before it is done: releases, and taking control from somebody else. Stops are never asked about.
import { AxisService } from '@proto/axis_service_pb';
import { SystemService } from '@proto/system_service_pb';
import { lane, refreshMachine, store, takeControl, tokenFor } from '../app';
import { t } from '../i18n';
import { byLane } from '../lane/calls';
import { asked } from '../motion';
import { CALL_MS, clients } from '../transport/clients';
import { Reason } from '@proto/error_pb';
import { confirmed } from './dialog';
import { notify } from './notices';

const timed = { timeoutMs: CALL_MS };

export function askReleaseAll(): void {
  const by = store.info.peek()?.inhibitedBy ?? '';
  confirmed(t('release-all.title'), t('release-all.text', { who: by || '?' }), t('action.release-all'), () => {
    void asked({ key: 'release-all.done' }, () => byLane(lane, SystemService.method.releaseStopAll, {})).then(() => refreshMachine());
  });
}

export function askRelease(axis: string): void {
  const holds = store.axis(axis)?.state.peek().holds ?? [];
  const who = holds.map(({ holder }) => holder).join(', ') || '?';
  confirmed(t('release.title', { axis }), t('release.text', { who }), t('action.release-hold'), () => {
    void asked({ key: 'release.done', values: { axis } },
               () => byLane(lane, AxisService.method.releaseStop, { axis, everybody: true, leaseToken: tokenFor(axis) }));
  });
}

export function acceptState(): void {
  confirmed(t('accept.title'), store.info.peek()?.stateUnaccepted || t('accept.text'), t('action.accept-state'), () => {
    void asked({ key: 'accept.done' }, () => clients.system.acceptState({}, timed)).then(() => refreshMachine());
  });
}

/** Without asking where nobody has it; else names who would lose it. */
export async function askTakeControl(axes: readonly string[]): Promise<void> {
  const refused = await takeControl(axes, false);
  const name = axes.join(', ');
  if (refused === null) return;
  if (refused.reason !== Reason.LEASE_REQUIRED && refused.reason !== Reason.BUSY) {
    notify('error', { key: 'control.refused', values: { axes: name } }, [refused.message, refused.remedy].filter(Boolean).join(': '));
    return;
  }
  confirmed(t('take.title', { axes: name }), `${refused.message}. ${t('take.text')}`, t('action.take-anyway'), () => {
    void takeControl(axes, true).then((again) => {
      if (again !== null) notify('error', { key: 'control.refused', values: { axes: name } }, again.message);
    });
  });
}
