// Hold to run through the real gateway and daemon.
//   AXISD=... AXISD_WEB=... AXISCTL=... node tests/web_page/real.mjs [FOLDER]        TEST: only tests whose names match
import { spawnSync } from 'node:child_process';
import { join, resolve } from 'node:path';
import { bundle, here, page, tree, web } from './tools.mjs';

const out = resolve(process.argv[2] ?? join(tree, 'build/web_page_real'));
await page(join(out, 'page'));
const bundles = await bundle([join(here, 'real/real.test.ts')], join(out, 'tests'));
const only = process.env.TEST ? [`--test-name-pattern=${process.env.TEST}`] : [];
const { status } = spawnSync(process.execPath, ['--enable-source-maps', '--test', ...only, ...bundles], {
  stdio: 'inherit',
  env: { ...process.env, AXISD_WEB_PAGE: join(out, 'page'), AXISD_WEB_MODULES: join(web, 'package.json'), AXISD_DEMO: join(tree, 'config/examples/demo.yaml') },
});
process.exit(status ?? 1);
