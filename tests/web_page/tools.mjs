// Bundles what is written in TypeScript here, with the libraries and message types of the page.
import { createRequire } from 'node:module';
import { mkdirSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';

export const here = dirname(fileURLToPath(import.meta.url));
export const tree = join(here, '../..');
export const web = join(tree, 'api/web');
const required = createRequire(join(web, 'package.json'));

/** Bundles files into `out`; the paths of the bundles. */
export async function bundle(files, out) {
  const { build } = required('esbuild');
  const { stubs } = await import(pathToFileURL(join(web, 'tools/stubs.mjs')).href);
  stubs();
  mkdirSync(out, { recursive: true });
  await build({
    entryPoints: files, bundle: true, format: 'esm', platform: 'node', target: 'node18', outdir: out, outExtension: { '.js': '.mjs' },
    nodePaths: [join(web, 'node_modules')], alias: { '@proto': join(web, 'generated/axisd/v1') }, logLevel: 'warning', sourcemap: 'inline',
    external: ['playwright-core'], outbase: here, absWorkingDir: web, tsconfigRaw: { compilerOptions: { target: 'ES2022' } },
  });
  return files.map((file) => join(out, file.slice(here.length + 1).replace(/\.ts$/, '.mjs')));
}

/** Builds the page into `out`. */
export async function page(out) {
  const { execFileSync } = await import('node:child_process');
  execFileSync(process.execPath, [join(web, 'tools/build.mjs'), out], { stdio: ['ignore', 'ignore', 'inherit'] });
}
