// Files that a user drops or chooses, with their paths below the folder that they were in.

export interface DroppedFile { path: string; file: File }
export interface Drop { name: string; files: DroppedFile[] }

const systemNames = /^(\.|Thumbs\.db$|desktop\.ini$|__MACOSX$|@eaDir$)/i;

const readEntries = (folder: FileSystemDirectoryEntry): Promise<FileSystemEntry[]> => {
  const reader = folder.createReader();
  const all: FileSystemEntry[] = [];
  return new Promise((done, failed) => {
    const next = (): void => reader.readEntries((some) => {
      all.push(...some);
      if (some.length) next(); // browsers give at most 100 at a time
      else done(all);
    }, failed);
    next();
  });
};

const walk = async (entry: FileSystemEntry, path: string, files: DroppedFile[]): Promise<void> => {
  if (systemNames.test(entry.name)) return;
  if (entry.isFile) {
    const file = await new Promise<File>((done, failed) => (entry as FileSystemFileEntry).file(done, failed));
    files.push({ path: path + entry.name, file });
    return;
  }
  for (const child of await readEntries(entry as FileSystemDirectoryEntry)) {
    await walk(child, `${path}${entry.name}/`, files);
  }
};

const common = (files: DroppedFile[]): string => {
  const first = files[0]?.path.split('/')[0] ?? '';
  return files.every(({ path }) => path.startsWith(`${first}/`)) ? first : '';
};

// Without the folder that holds all of them, which names the scene.
const named = (files: DroppedFile[], name: string): Drop => {
  const folder = common(files);
  const inside = folder ? files.map(({ path, file }) => ({ path: path.slice(folder.length + 1), file })) : files;
  return { name: folder || name, files: inside };
};

const nameOf = (files: DroppedFile[]): string =>
  files.length === 1 ? files[0]!.file.name.replace(/\.[^.]*$/, '') : 'Photos';

export const filesOfDrop = async (transfer: DataTransfer): Promise<Drop> => {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry()).filter((entry) => entry !== null);
  const files: DroppedFile[] = [];
  for (const entry of entries) await walk(entry, '', files);
  return named(files, nameOf(files));
};

export const filesOfInput = (input: HTMLInputElement): Drop => {
  const files = [...input.files ?? []]
    .map((file) => ({ path: file.webkitRelativePath || file.name, file }))
    .filter(({ path }) => !path.split('/').some((part) => systemNames.test(part)));
  return named(files, nameOf(files));
};
