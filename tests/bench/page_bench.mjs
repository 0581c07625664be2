// The page of axisd-web in Chromium, before a real gateway and daemon: README.md says what is measured.
//   node tests/bench/page_bench.mjs BUILD [stop|all|slow|pages|bad|heap [NUMBER [TIMES]]]        (default: all but heap)
import { spawnSync } from 'node:child_process';
import { join, resolve } from 'node:path';
import { bundle, page, tree, web } from '../web_page/tools.mjs';

const [build = join(tree, 'build/release'), ...words] = process.argv.slice(2);
const out = join(resolve(build), 'page_bench');
await page(join(out, 'page'));
const [program] = await bundle(['bench', 'hasty_machine', 'bad_input'].map((name) => join(tree, `tests/web_page/bench/${name}.ts`)), join(out, 'bench'));
const { status } = spawnSync(process.execPath, ['--enable-source-maps', program, ...words], {
  stdio: 'inherit',
  env: {
    ...process.env, AXISD: join(resolve(build), 'daemon/axisd'), AXISD_WEB: join(resolve(build), 'api/web/gateway/axisd-web'),
    AXISCTL: join(resolve(build), 'api/axisctl/axisctl'), AXISD_WEB_PAGE: join(out, 'page'), AXISD_WEB_MODULES: join(web, 'package.json'),
    AXISD_DEMO: join(tree, 'config/examples/demo.yaml'),
  },
});
process.exit(status ?? 1);
