// Builds the page: index.html, and in assets/ what it needs, by names that change with their content, each beside its
// gzip. Into the folder given, else build/web of the tree.
import { readFileSync, readdirSync, renameSync, rmSync, writeFileSync, mkdirSync } from 'node:fs';
import { createHash } from 'node:crypto';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { gzipSync } from 'node:zlib';
import { build } from 'esbuild';
import { stubs } from './stubs.mjs';

const here = dirname(dirname(fileURLToPath(import.meta.url)));
const target = resolve(process.argv[2] ?? join(here, '../../build/web'));
const FIRST_LOAD = 130 * 1000;  // bytes of gzip: what the page may weigh before it is usable

/** First characters of the hash of some bytes. */
const hashed = (bytes) => createHash('sha256').update(bytes).digest('hex').slice(0, 10);

stubs();
const work = `${target}.new`;
rmSync(work, { recursive: true, force: true });
mkdirSync(join(work, 'assets'), { recursive: true });
const result = await build({
  entryPoints: [join(here, 'page/src/main.tsx')],
  bundle: true, format: 'esm', splitting: true, minify: true, target: 'es2022', metafile: true, legalComments: 'none',
  outdir: join(work, 'assets'), entryNames: '[name]-[hash]', chunkNames: '[name]-[hash]', jsx: 'automatic',
  jsxImportSource: 'preact', logLevel: 'warning', absWorkingDir: here,
  define: { 'process.env.NODE_ENV': '"production"' },
});

const outputs = Object.entries(result.metafile.outputs);
const [script, entry] = outputs.find(([, output]) => output.entryPoint?.endsWith('main.tsx'));
const name = (path) => path.split('/').pop();
const icon = readFileSync(join(here, 'page/src/icon.svg'));
const iconName = `icon-${hashed(icon)}.svg`;
writeFileSync(join(work, 'assets', iconName), icon);
const html = readFileSync(join(here, 'page/src/index.html'), 'utf8')
  .replace('{{script}}', `/assets/${name(script)}`)
  .replace('{{style}}', `/assets/${name(entry.cssBundle)}`)
  .replace('{{icon}}', `/assets/${iconName}`);
writeFileSync(join(work, 'index.html'), html);

const sizes = {};
for (const path of ['index.html', ...readdirSync(join(work, 'assets')).map((file) => `assets/${file}`)]) {
  const zipped = gzipSync(readFileSync(join(work, path)), { level: 9 });
  writeFileSync(join(work, `${path}.gz`), zipped);
  sizes[path] = zipped.length;
}
// What the first load fetches: the page, its style, its script, and what that imports at once.
const first = new Set(['index.html', `assets/${name(script)}`, `assets/${name(entry.cssBundle)}`, `assets/${iconName}`]);
const queue = [entry];
while (queue.length > 0) {
  for (const { path, kind } of queue.pop().imports) {
    const file = `assets/${name(path)}`;
    if (kind !== 'import-statement' || first.has(file)) continue;
    first.add(file);
    queue.push(result.metafile.outputs[path]);
  }
}
const total = [...first].reduce((sum, file) => sum + sizes[file], 0);
rmSync(target, { recursive: true, force: true });
renameSync(work, target);
console.log(`${target}: first load ${(total / 1000).toFixed(1)} kB gzip (at most ${FIRST_LOAD / 1000})`);
if (total > FIRST_LOAD) {
  console.error('the page is too heavy');
  process.exitCode = 1;
}
