// node unit_tests.mjs FOLDER: checks the types, bundles the painter as a page does, runs its unit tests.
import { spawnSync } from 'node:child_process';
import { statSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';

import { prepare, sources } from './prepare.mjs';

const folder = process.argv[2];
const { checkTypes, bundle, testFiles } = prepare(folder);
checkTypes();

const [page] = await bundle([join(sources, 'index.ts')], join(folder, 'page'), { format: 'esm', minify: true });
const kib = Math.round(statSync(page).size / 1024);
console.log(`painter: ${kib} KiB`);
if (kib > 150) throw new Error('the painter is to stay below 150 KiB');

const out = join(folder, 'unit');
const files = await bundle(testFiles, out, { format: 'esm', platform: 'node', sourcemap: 'inline' });
writeFileSync(join(out, 'package.json'), '{"type": "module"}\n');
const result = spawnSync(process.execPath, ['--enable-source-maps', '--test', ...files], {
  stdio: 'inherit', env: { ...process.env, PAINT_FIXTURES: join(sources, 'fixtures') },
});
process.exit(result.status ?? 1);
