// Every text in every language, with the same values in it.
import assert from 'node:assert/strict';
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { de } from '../src/i18n/de';
import { en } from '../src/i18n/en';
import { zh } from '../src/i18n/zh';
import { classKey, endKey, kindKey, linkKey, networkKey, reasonKey, roleKey, stateKey, trustKey } from '../src/i18n/names';
import { Reason } from '@proto/error_pb';
import { Role } from '@proto/access_pb';
import { CommandKind, CommandState, LinkState, PositionTrust, State } from '@proto/types_pb';
import { NetworkLink, TransactionClass } from '@proto/bus_service_pb';
import { places } from '../src/route';

const values = (text: string) => [...text.matchAll(/\{(\w+)\}/g)].map(([whole]) => whole).sort();

test('the languages have the same texts, none empty, with the same values', () => {
  for (const [name, texts] of Object.entries({ de, zh })) {
    assert.deepEqual(Object.keys(texts).sort(), Object.keys(en).sort(), name);
    for (const key of Object.keys(en) as (keyof typeof en)[]) {
      assert.notEqual(texts[key].trim(), '', `${name}: ${key}`);
      assert.deepEqual(values(texts[key]), values(en[key]), `${name}: ${key}`);
    }
  }
});

test('what the contract counts has a name', () => {
  const all: [string, { [name: string]: string | number }, (value: number) => unknown][] = [
    ['State', State, stateKey], ['LinkState', LinkState, linkKey], ['PositionTrust', PositionTrust, trustKey], ['CommandKind', CommandKind, kindKey],
    ['CommandState', CommandState, endKey], ['Reason', Reason, reasonKey], ['Role', Role, roleKey], ['NetworkLink', NetworkLink, networkKey],
    ['TransactionClass', TransactionClass, classKey]];
  for (const [name, names, key] of all) {
    for (const value of Object.values(names)) {
      if (typeof value === 'number' && value !== 0) assert.notEqual(key(value), null, `${name} ${names[value]}`);
    }
  }
  for (const { title } of places) assert.ok(title in en);
});

test('no text is left that nothing shows', () => {
  const sources: string[] = [];
  const collect = (folder: string) => {
    for (const entry of readdirSync(folder, { withFileTypes: true })) {
      const path = join(folder, entry.name);
      if (entry.isDirectory()) collect(path);
      else if (/\.tsx?$/.test(entry.name) && !/i18n.(en|de|zh)\.ts$/.test(path)) sources.push(readFileSync(path, 'utf8'));
    }
  };
  collect(join(process.cwd(), 'page/src'));
  const code = sources.join('\n');
  // Families whose keys are put together from what the contract or a state machine says.
  const families = /^(state|link|trust|kind|end|reason|role|network|class|loss|why|how|nav|quantity|control\.ended|command)\./;
  for (const key of Object.keys(en)) {
    if (!families.test(key)) assert.ok(code.includes(`'${key}'`), key);
  }
});
