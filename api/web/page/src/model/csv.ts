// Samples as a table for other programs: one line per sample, with every digit that came from the daemon.
import type { Sample } from './series';

/** "2026-01-02T03:04:05.678901Z", of milliseconds since 1970. */
export function isoTime(at: number): string {
  const seconds = Math.floor(at / 1000);
  const microseconds = Math.round((at - seconds * 1000) * 1000);
  const whole = microseconds >= 1_000_000 ? seconds + 1 : seconds;
  const rest = microseconds >= 1_000_000 ? 0 : microseconds;
  return `${new Date(whole * 1000).toISOString().slice(0, 19)}.${String(rest).padStart(6, '0')}Z`;
}

export interface Table { axis: string; unit: string; terminals: readonly string[]; samples: readonly Sample[] }

const number = (value: number): string => (Number.isNaN(value) ? '' : String(value));

/** With a header; the terminals of all axes have a column each, by name. */
export function csv(tables: readonly Table[], stateName: (state: number) => string): string {
  const names = [...new Set(tables.flatMap(({ terminals }) => terminals))];
  const lines = [['time', 'axis', 'unit', 'position', 'velocity', 'target', 'following_error', 'moving', 'state', ...names].join(',')];
  for (const { axis, unit, terminals, samples } of tables) {
    for (const sample of samples) {
      const bits = names.map((name) => {
        const index = terminals.indexOf(name);
        return index < 0 ? '' : String((sample.terminals >>> index) & 1);
      });
      lines.push([isoTime(sample.at), axis, unit, number(sample.position), number(sample.velocity), number(sample.target),
                  number(sample.error), sample.moving ? '1' : '0', stateName(sample.state), ...bits].join(','));
    }
  }
  return lines.join('\r\n') + '\r\n';
}
