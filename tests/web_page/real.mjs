// The page through the real gateway and daemon.
//   AXISD=... AXISD_WEB=... AXISCTL=... node tests/web_page/real.mjs [FOLDER] [NAME ...]
// NAME: only tests/web_page/real/NAME.test.ts; TEST: only tests whose names match
import { spawnSync } from 'node:child_process';
import { readdirSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { bundle, here, page, tree, web } from './tools.mjs';

const [folder = join(tree, 'build/web_page_real'), ...names] = process.argv.slice(2);
const out = resolve(folder);
const files = readdirSync(join(here, 'real')).filter((name) => name.endsWith('.test.ts'))
  .filter((name) => names.length === 0 || names.includes(name.replace('.test.ts', '')));
await page(join(out, 'page'));
const bundles = await bundle(files.map((name) => join(here, 'real', name)), join(out, 'tests'));
const only = process.env.TEST ? [`--test-name-pattern=${process.env.TEST}`] : [];
const { status } = spawnSync(process.execPath, ['--enable-source-maps', '--test', ...only, ...bundles], {
  stdio: 'inherit',
  env: { ...process.env, AXISD_WEB_PAGE: join(out, 'page'), AXISD_WEB_MODULES: join(web, 'package.json'), AXISD_DEMO: join(tree, 'config/examples/demo.yaml') },
});
process.exit(status ?? 1);
