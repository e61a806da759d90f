// For tests: a script of the page of a scene. In core/view/page of COLOR3D_SOURCES or, without it, above the folder in
// which the tests run.
import { existsSync, readFileSync } from 'node:fs';
import { dirname, join } from 'node:path';

export const viewPageScript = (name: string): string => {
  let folder = process.env.COLOR3D_SOURCES ?? process.cwd();
  const path = (): string => join(folder, 'core/view/page', name);
  while (!existsSync(path()) && folder !== dirname(folder)) folder = dirname(folder);
  return readFileSync(path(), 'utf8');
};
