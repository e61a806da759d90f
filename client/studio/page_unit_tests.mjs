// node page_unit_tests.mjs ESBUILD FOLDER: bundles the unit tests of the page's modules into FOLDER and runs them.
// The painter brings its own.
import { execFileSync, spawnSync } from 'node:child_process';
import { mkdirSync, readdirSync, writeFileSync } from 'node:fs';
import { dirname, join, relative } from 'node:path';
import { fileURLToPath } from 'node:url';

const [esbuild, folder] = process.argv.slice(2);
const page = join(dirname(fileURLToPath(import.meta.url)), 'page');
const tests = readdirSync(page, { recursive: true }).map(String)
  .filter((name) => name.endsWith('_test.ts') && !name.startsWith('paint/')).sort();
if (!tests.length) throw new Error('there are no tests');
mkdirSync(folder, { recursive: true });
writeFileSync(join(folder, 'package.json'), '{"type": "module"}\n');
execFileSync(esbuild, [
  ...tests.map((name) => join(page, name)), '--bundle', '--platform=node', '--format=esm', '--sourcemap=inline',
  '--log-level=warning', `--outbase=${page}`, `--outdir=${folder}`,
], { stdio: 'inherit' });
const files = tests.map((name) => relative(process.cwd(), join(folder, name.replace(/\.ts$/, '.js'))));
const result = spawnSync(process.execPath, ['--enable-source-maps', '--test', ...files], { stdio: 'inherit' });
process.exit(result.status ?? 1);
