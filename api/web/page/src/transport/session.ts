// Who uses this page.
import { signal } from '@preact/signals';

export type Session =
  | { at: 'unknown' }
  | { at: 'out' }
  /** The gateway does not answer. */
  | { at: 'unreachable' }
  /** `machines`: that the gateway serves; none: there is one, which has no name here. */
  | { at: 'in'; name: string; how: 'password' | 'certificate' | 'loopback'; machines: readonly Machine[] };

/** `trouble`: why nothing can be asked of it; empty: it can. */
export interface Machine { name: string; trouble: string }

/** Whether somebody is logged in where there is that machine; empty: one without a name. */
export const serves = (now: Session, machine: string): boolean =>
  now.at === 'in' && (now.machines.length === 0 ? machine === '' : now.machines.some(({ name }) => name === machine));

export const session = signal<Session>({ at: 'unknown' });

/** Asks the gateway. */
export async function refreshSession(): Promise<void> {
  try {
    const answer = await fetch('/session', { credentials: 'same-origin' });
    if (answer.status === 401) { session.value = { at: 'out' }; return; }
    if (!answer.ok) throw new Error(answer.statusText);
    const { name, how, machines = [] } = await answer.json() as { name: string; how: 'password' | 'certificate' | 'loopback'; machines?: Machine[] };
    const next: Session = { at: 'in', name, how, machines };
    if (JSON.stringify(next) !== JSON.stringify(session.value)) session.value = next;
  } catch {
    if (session.value.at !== 'in') session.value = { at: 'unreachable' };
  }
}

export interface Refusal { reason: string; message: string; retryAfterMs: number }

/** Null: it went well. */
export async function signIn(name: string, password: string): Promise<Refusal | null> {
  try {
    const answer = await fetch('/session', {
      method: 'POST', credentials: 'same-origin', headers: { 'content-type': 'application/json' },
      body: JSON.stringify({ name, password }),
    });
    if (answer.status === 204) { await refreshSession(); return null; }
    const refusal = await answer.json().catch(() => ({})) as { reason?: string; message?: string; retry_after_ms?: number };
    return { reason: refusal.reason ?? '', message: refusal.message ?? answer.statusText, retryAfterMs: refusal.retry_after_ms ?? 0 };
  } catch (error) {
    return { reason: 'unreachable', message: String(error), retryAfterMs: 0 };
  }
}

export async function signOut(): Promise<void> {
  await fetch('/session', { method: 'DELETE', credentials: 'same-origin' }).catch(() => {});
  session.value = { at: 'out' };
}
