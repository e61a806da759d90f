// node unit_tests.mjs ESBUILD FOLDER: bundles the unit tests of the corrections into FOLDER and runs them.
import { execFileSync, spawnSync } from 'node:child_process';
import { mkdirSync, readdirSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const [esbuild, folder] = process.argv.slice(2);
const sources = dirname(dirname(fileURLToPath(import.meta.url)));
const tests = readdirSync(sources, { recursive: true }).filter((name) => name.endsWith('_test.ts')).map((name) => join(sources, name));
mkdirSync(folder, { recursive: true });
writeFileSync(join(folder, 'package.json'), '{"type": "module"}\n');
execFileSync(esbuild, [...tests, '--bundle', '--platform=node', '--format=esm', '--sourcemap=inline', '--log-level=warning',
  `--outbase=${sources}`, `--outdir=${folder}`], { stdio: 'inherit' });
const files = readdirSync(folder, { recursive: true }).filter((name) => name.endsWith('_test.js')).map((name) => join(folder, name));
const env = { ...process.env, COLOR3D_SOURCES: join(sources, '../../../..') };
process.exit(spawnSync(process.execPath, ['--enable-source-maps', '--test', ...files], { stdio: 'inherit', env }).status ?? 1);
