// What the tests of the painter need: packages, types checked, bundles. Ends with 77, "skipped", where it cannot be had.
import { execFileSync, spawnSync } from 'node:child_process';
import { copyFileSync, existsSync, mkdirSync, readdirSync, readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { dirname, join, relative } from 'node:path';
import { fileURLToPath } from 'node:url';

export const sources = dirname(dirname(fileURLToPath(import.meta.url)));

export const skip = (why) => {
  console.log(`skipped, because ${why}`);
  process.exit(77);
};

// Installs exactly the locked packages into `folder`, once.
const install = (folder) => {
  mkdirSync(folder, { recursive: true });
  const locked = readFileSync(join(sources, 'package-lock.json'), 'utf8');
  const copy = join(folder, 'package-lock.json');
  const isThere = existsSync(join(folder, 'node_modules', '.package-lock.json')) && existsSync(copy) &&
    readFileSync(copy, 'utf8') === locked;
  if (isThere) return;
  for (const name of ['package.json', 'package-lock.json']) copyFileSync(join(sources, name), join(folder, name));
  const result = spawnSync('npm', ['ci', '--ignore-scripts', '--no-audit', '--no-fund', '--fetch-retries=0'],
    { cwd: folder, encoding: 'utf8', timeout: 120000 });
  if (result.error || result.status !== 0) skip(`npm cannot install its packages: ${result.error ?? result.stderr}`);
};

const filesBelow = (folder, ending) => readdirSync(folder, { withFileTypes: true, recursive: true })
  .filter((entry) => entry.isFile() && entry.name.endsWith(ending))
  .map((entry) => join(entry.parentPath ?? entry.path, entry.name))
  .filter((file) => !file.includes('node_modules'))
  .sort();

// Returns { checkTypes, bundle, testFiles } with the packages in `folder`.
export const prepare = (folder) => {
  install(folder);
  const require = createRequire(join(folder, 'package.json'));
  const esbuild = require('esbuild');
  const bundle = async (files, out, options) => {
    const result = await esbuild.build({
      entryPoints: files, outdir: out, outbase: sources, bundle: true, target: 'es2022', logLevel: 'error',
      charset: 'utf8', ...options,
    });
    if (result.warnings.length) throw new Error('esbuild warns');
    return files.map((file) => join(out, relative(sources, file).replace(/\.ts$/, '.js')));
  };
  return {
    checkTypes: () => execFileSync(process.execPath, [
      require.resolve('typescript/bin/tsc'), '-p', sources,
      '--typeRoots', join(folder, 'node_modules', '@types'),
    ], { stdio: 'inherit' }),
    bundle,
    testFiles: filesBelow(sources, '_test.ts'),
  };
};
