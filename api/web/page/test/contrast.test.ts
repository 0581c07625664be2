// Every text has a contrast of 7:1 to what it stands on, in light and dark.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';

const css = readFileSync(join(process.cwd(), 'page/src/style/page.css'), 'utf8');

function colours(selector: string): Map<string, string> {
  const [, block] = css.split(`${selector} {`);
  return new Map([...block!.split('}')[0]!.matchAll(/--([\w-]+):\s*(#[0-9a-f]{6})/g)].map(([, name, value]) => [name!, value!]));
}

function luminance(colour: string): number {
  const [r, g, b] = [1, 3, 5].map((at) => {
    const value = parseInt(colour.slice(at, at + 2), 16) / 255;
    return value <= 0.03928 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
  });
  return 0.2126 * r! + 0.7152 * g! + 0.0722 * b!;
}

function contrast(a: string, b: string): number {
  const [high, low] = [luminance(a), luminance(b)].sort((x, y) => y - x);
  return (high! + 0.05) / (low! + 0.05);
}

const grounds = ['ground', 'surface', 'raised'];
const pairs: [string, string[]][] = [
  ['text', [...grounds, 'accent-soft', 'alarm-soft', 'warn-soft']], ['muted', [...grounds, 'accent-soft', 'warn-soft']], ['accent', grounds], ['alarm', [...grounds, 'alarm-soft']],
  ['warn', [...grounds, 'warn-soft']], ['good', grounds], ['move', ['surface', 'move-soft', 'ground']], ['on-accent', ['accent']], ['on-stop', ['stop']],
  ['surface', ['move']]];

for (const [theme, selector] of [['light', ':root'], ['dark', ":root[data-theme='dark']"]] as const) {
  test(`contrast: ${theme}`, () => {
    const known = colours(selector);
    for (const [text, on] of pairs) {
      for (const ground of on) {
        const ratio = contrast(known.get(text)!, known.get(ground)!);
        assert.ok(ratio >= 7, `${text} on ${ground}: ${ratio.toFixed(2)}`);
      }
    }
    // Curves are shapes: 4.5 will do, and they have dashes besides.
    for (let index = 0; index < 6; ++index) assert.ok(contrast(known.get(`trace-${index}`)!, known.get('surface')!) >= 4.5);
  });
}
