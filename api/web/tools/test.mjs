// Bundles the unit tests (page/test/*.test.ts) and runs them with Node's own test runner.
import { spawnSync } from 'node:child_process';
import { mkdtempSync, readdirSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';
import { stubs } from './stubs.mjs';

const here = dirname(dirname(fileURLToPath(import.meta.url)));
const tests = readdirSync(join(here, 'page/test')).filter((name) => /\.test\.tsx?$/.test(name));
stubs();
const out = mkdtempSync(join(tmpdir(), 'axisd-web-test-'));
await build({
  entryPoints: tests.map((name) => join(here, 'page/test', name)), bundle: true, format: 'esm', platform: 'node',
  target: 'node18', outdir: out, outExtension: { '.js': '.mjs' }, jsx: 'automatic', jsxImportSource: 'preact',
  logLevel: 'warning', absWorkingDir: here, sourcemap: 'inline',
});
const files = readdirSync(out).filter((name) => name.endsWith('.mjs')).map((name) => join(out, name));
const { status } = spawnSync(process.execPath, ['--enable-source-maps', '--test', ...files], { stdio: 'inherit' });
rmSync(out, { recursive: true, force: true });
process.exitCode = status ?? 1;
