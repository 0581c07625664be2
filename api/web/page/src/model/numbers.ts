// Numbers as people read and write them.

/** A value with so many digits that it can be told from its neighbours, and no more: 120.000, 41.2. */
export function decimals(unit: string): number {
  const base = unit.split('/')[0]!;
  return base === 'mm' ? 3 : base === 'rev' ? 4 : base === 'm' ? 5 : base === 'deg' ? 2 : 3;
}

export function shown(value: number, digits: number): string {
  if (!Number.isFinite(value)) return '-';
  const text = value.toFixed(digits);
  return Number(text) === 0 ? text.replace('-', '') : text;
}

/** What somebody typed: a comma counts as the decimal point. Null: it is no number. */
export function typed(text: string): number | null {
  const plain = text.trim().replace(',', '.').replace('\u2212', '-');
  if (!/^[+-]?(\d+\.?\d*|\.\d+)$/.test(plain)) return null;
  return Number(plain);
}

/** A key of the page's own keypad, put to what was typed. */
export function keyed(text: string, key: string): string {
  if (key === 'clear') return '';
  if (key === 'back') return text.slice(0, -1);
  if (key === 'sign') return text.startsWith('-') ? text.slice(1) : `-${text}`;
  if (key === '.') return text.includes('.') || text.length >= 12 ? text : `${text}.`;
  return text.length >= 12 ? text : text + key;
}

/** 0.9 s, 12 s, 3 min: an age for people. */
export function ageText(milliseconds: number): string {
  const seconds = milliseconds / 1000;
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  if (seconds < 120) return `${Math.round(seconds)} s`;
  if (seconds < 7200) return `${Math.round(seconds / 60)} min`;
  return `${Math.round(seconds / 3600)} h`;
}

/** 7.8 ms, 41 ms, 1.25 s. */
export function spanText(milliseconds: number): string {
  if (milliseconds >= 1000) return `${(milliseconds / 1000).toFixed(2)} s`;
  return milliseconds >= 100 ? `${Math.round(milliseconds)} ms` : `${milliseconds.toFixed(1)} ms`;
}
