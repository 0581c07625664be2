// Builds the page, bundles the browser tests and runs them with Node's own test runner.
//   node tests/web_page/run.mjs [FOLDER] [NAME ...]     pictures go to FOLDER/pictures; NAME: only tests/web_page/browser/NAME.test.ts
import { spawnSync } from 'node:child_process';
import { readdirSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { bundle, here, page, tree, web } from './tools.mjs';

const [folder = join(tree, 'build/web_page'), ...names] = process.argv.slice(2);
const out = resolve(folder);
const files = readdirSync(join(here, 'browser')).filter((name) => name.endsWith('.test.ts'))
  .filter((name) => names.length === 0 || names.includes(name.replace('.test.ts', '')));
await page(join(out, 'page'));
const bundles = await bundle(files.map((name) => join(here, 'browser', name)), join(out, 'tests'));
// TEST: only tests whose names match.
const only = process.env.TEST ? [`--test-name-pattern=${process.env.TEST}`] : [];
const { status } = spawnSync(process.execPath, ['--enable-source-maps', '--test', ...only, ...bundles], {
  stdio: 'inherit',
  env: { ...process.env, AXISD_WEB_PAGE: join(out, 'page'), AXISD_WEB_PICTURES: join(out, 'pictures'), AXISD_WEB_MODULES: join(web, 'package.json') },
});
process.exit(status ?? 1);
