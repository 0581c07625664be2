// The object dictionary of a drive from its maker's data sheet, for the library `canopen`. Makers' files have flaws that
// the library's own reader does not take, so the file is read here; what it says goes in by the library's calls.
'use strict';
const fs = require('fs');
const Module = require('module');

// Needed for block transfers alone, which nobody asks for here; it would have to be compiled.
const load = Module._load;
Module._load = (name, ...rest) => (name === 'node-crc' ? { crc: () => { throw new Error('no CRC'); } } : load(name, ...rest));
const { Eds } = require('canopen');

const VAR = 7, ARRAY = 8, RECORD = 9;
const SIGNED = { 2: 8, 3: 16, 4: 32, 0x10: 24 }, UNSIGNED = { 1: 8, 5: 8, 6: 16, 7: 32, 0x16: 24 };
const REAL = [8, 0x11], TEXT = [9, 0x0A, 0x0B], WIDE = [0x15, 0x1B];
const MOST_PDOS = 4;

function sections(path) {
  const all = new Map();
  let current = null;
  for (const line of fs.readFileSync(path, 'latin1').split(/\r?\n/)) {
    const heading = line.match(/^\s*\[([^\]]*)\]/), pair = line.match(/^\s*([^;=\s][^=]*?)\s*=\s*(.*?)\s*$/);
    if (heading) all.set(heading[1].trim().toLowerCase(), current = {});
    else if (pair && current) current[pair[1].toLowerCase()] = pair[2];
  }
  return all;
}

/// A number as CiA 306 writes it, with $NODEID; undefined: there is none.
function number(text, node) {
  if (!text) return undefined;
  const sum = text.split('+').map((part) => part.trim()).filter((part) => part)
    .map((part) => (/^\$NODEID$/i.test(part) ? node : Number(/^-?0[0-7]+$/.test(part) ? parseInt(part, 8) : part)));
  const value = sum.reduce((a, b) => a + b, 0);
  return sum.length && Number.isFinite(value) ? Math.trunc(value) : undefined;
}

/// As the type has it.
function wrap(value, type) {
  if (value === undefined) return undefined;
  const bits = SIGNED[type] || UNSIGNED[type];
  if (!bits) return value;
  const range = 2 ** bits, positive = ((value % range) + range) % range;
  return SIGNED[type] && positive >= range / 2 ? positive - range : positive;
}

/// undefined: nothing that the library can hold, or that a drive needs.
function described(entry, node) {
  const type = number(entry.datatype, node);
  const data = { parameterName: entry.parametername || 'unnamed', objectType: VAR, dataType: type,
                 accessType: (entry.accesstype || 'rw').toLowerCase() };
  const text = entry.parametervalue || entry.defaultvalue;
  if (TEXT.includes(type)) return { ...data, defaultValue: text || 'unknown' };
  if (REAL.includes(type)) return { ...data, defaultValue: Number(text) || 0 };
  if (WIDE.includes(type)) return { ...data, defaultValue: number(text, node) || 0 };
  if (!SIGNED[type] && !UNSIGNED[type]) return undefined;
  const low = wrap(number(entry.lowlimit, node), type), high = wrap(number(entry.highlimit, node), type);
  const limits = low !== undefined && high !== undefined && low < high ? { lowLimit: low, highLimit: high } : {};
  return { ...data, ...limits, defaultValue: wrap(number(text, node), type) || 0 };
}

function isLeftOut(index) {
  if (index >= 0x1200 && index < 0x1300) return true;  // SDO channels: the default one is made below
  return index >= 0x1400 && index < 0x1C00 && (index & 0x1FF) >= MOST_PDOS;
}

/// The dictionary of node `node`, as after power-up.
function dictionaryOf(path, node) {
  const eds = new Eds(), file = sections(path), subs = new Map();
  for (const key of [...eds.keys()]) eds.removeEntry(parseInt(key, 16));  // it begins with some
  for (const [name, entry] of file) {
    const match = name.match(/^([0-9a-f]{4})sub([0-9a-f]{1,2})$/);
    if (match) subs.set(match[1], [...(subs.get(match[1]) || []), [parseInt(match[2], 16), entry]]);
  }
  for (const [name, entry] of file) {
    if (!/^[0-9a-f]{4}$/.test(name) || isLeftOut(parseInt(name, 16))) continue;
    const index = parseInt(name, 16), kind = number(entry.objecttype, node) || VAR;
    if (kind === VAR) {
      const data = described(entry, node);
      if (data) eds.addEntry(index, data);
    } else if (kind === ARRAY || kind === RECORD) {
      eds.addEntry(index, { parameterName: entry.parametername || name, objectType: kind });
      // The library raises sub-index 0 with each one that is added: the file's own comes last.
      const all = (subs.get(name) || []).sort(([a], [b]) => (a || 256) - (b || 256));
      for (const [sub, part] of all) {
        const data = described(part, node);
        if (data) eds.addSubEntry(index, sub, data);
      }
    }
  }
  // Who it is stands at the head of some files alone.
  const head = file.get('deviceinfo') || {}, identity = eds.getEntry(0x1018);
  for (const [sub, key] of [[1, 'vendornumber'], [2, 'productnumber'], [3, 'revisionnumber']])
    if (identity && identity[sub] && identity[sub].value === 0)
      identity[sub].value = wrap(number(head[key], node) || 0, identity[sub].dataType);
  eds.addSdoServerParameter(0, 0x580 + node, 0x600 + node);
  return eds;
}

module.exports = { dictionaryOf, wrap };
