// node unit_tests.mjs FOLDER ESBUILD: bundles the unit tests of this folder into FOLDER with the program esbuild and
// runs them.
import { spawnSync } from 'node:child_process';
import { mkdirSync, readdirSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const [folder, esbuild] = process.argv.slice(2);
const sources = dirname(dirname(fileURLToPath(import.meta.url)));
const tests = readdirSync(sources).filter((name) => name.endsWith('_test.ts'));
const run = (program, args) => {
  const { status, error } = spawnSync(program, args, { stdio: 'inherit' });
  if (error) throw error;
  if (status !== 0) process.exit(status ?? 1);
};
mkdirSync(folder, { recursive: true });
run(esbuild, [...tests.map((name) => join(sources, name)), '--bundle', '--format=esm', '--platform=node',
  '--sourcemap=inline', '--log-level=warning', '--outdir=' + folder]);
writeFileSync(join(folder, 'package.json'), '{"type": "module"}\n');
run(process.execPath, ['--enable-source-maps', '--test', ...tests.map((name) => join(folder, name.replace(/ts$/, 'js')))]);
