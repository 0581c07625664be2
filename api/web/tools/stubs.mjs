// Makes the message types of proto/ as TypeScript, in generated/. Not committed: the contract is proto/.
import { execFileSync } from 'node:child_process';
import { mkdirSync, readdirSync, rmSync, statSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = dirname(dirname(fileURLToPath(import.meta.url)));
const proto = process.env.AXISD_PROTO ?? join(here, '../../proto');
const out = join(here, 'generated');
const sources = readdirSync(join(proto, 'axisd/v1')).filter((name) => name.endsWith('.proto'))
  .map((name) => join(proto, 'axisd/v1', name));

/** Newest change of some files; 0 where one is missing. */
function newest(paths) {
  return Math.max(...paths.map((path) => statSync(path, { throwIfNoEntry: false })?.mtimeMs ?? 0));
}

/** Makes them unless they are there and newer than what they are made of. */
export function stubs() {
  const made = sources.map((path) => join(out, 'axisd/v1', path.split('/').pop().replace('.proto', '_pb.ts')));
  const oldest = Math.min(...made.map((path) => statSync(path, { throwIfNoEntry: false })?.mtimeMs ?? 0));
  if (oldest > newest(sources)) return;
  rmSync(out, { recursive: true, force: true });
  mkdirSync(out, { recursive: true });
  execFileSync('protoc', [
    `--plugin=protoc-gen-es=${join(here, 'node_modules/.bin/protoc-gen-es')}`,
    `--es_out=${out}`, '--es_opt=target=ts,import_extension=none', `-I${proto}`, ...sources,
  ], { stdio: ['ignore', 'inherit', 'inherit'] });
}

if (process.argv[1] === fileURLToPath(import.meta.url)) stubs();
