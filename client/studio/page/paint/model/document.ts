// The strokes on a photo with all that was done to them. Entries never change; a command replaces a run of the
// list by another, so that it costs only what it touches, and any number of them can be undone.
import type { StrokeEntry, StrokeFile } from './stroke_file';

export interface Command {
  readonly name: string;
  readonly at: number;
  readonly removed: StrokeFile;
  readonly added: StrokeFile;
}

// The shortest replacement that turns `before` into `after`, which share their unchanged entries.
export const commandBetween = (name: string, before: StrokeFile, after: StrokeFile): Command => {
  let at = 0;
  const shorter = Math.min(before.length, after.length);
  while (at < shorter && before[at] === after[at]) ++at;
  let tail = 0;
  while (tail < shorter - at && before[before.length - 1 - tail] === after[after.length - 1 - tail]) ++tail;
  return { name, at, removed: before.slice(at, before.length - tail), added: after.slice(at, after.length - tail) };
};

export class StrokeDocument {
  private list: StrokeEntry[] = [];
  private done: Command[] = [];
  private undone: Command[] = [];

  constructor(private readonly onChange: (isReset: boolean) => void = () => {}) {}

  get entries(): StrokeFile {
    return this.list;
  }
  // The names of what undo and redo would do; undefined: nothing.
  get undoName(): string | undefined {
    return this.done.at(-1)?.name;
  }
  get redoName(): string | undefined {
    return this.undone.at(-1)?.name;
  }
  get commands(): readonly Command[] {
    return this.done;
  }

  // Forgets the history.
  reset(strokes: StrokeFile): void {
    this.list = [...strokes];
    this.done = [];
    this.undone = [];
    this.onChange(true);
  }
  add(name: string, added: StrokeFile): void {
    this.run({ name, at: this.list.length, removed: [], added });
  }
  replaceAll(name: string, after: StrokeFile): void {
    this.run(commandBetween(name, this.list, after));
  }
  undo(): string | undefined {
    const command = this.done.pop();
    if (!command) return undefined;
    this.splice(command.at, command.added.length, command.removed);
    this.undone.push(command);
    this.onChange(false);
    return command.name;
  }
  redo(): string | undefined {
    const command = this.undone.pop();
    if (!command) return undefined;
    this.splice(command.at, command.removed.length, command.added);
    this.done.push(command);
    this.onChange(false);
    return command.name;
  }

  private run(command: Command): void {
    if (command.removed.length === 0 && command.added.length === 0) return;
    this.splice(command.at, command.removed.length, command.added);
    this.done.push(command);
    this.undone = [];
    this.onChange(false);
  }
  // A new list each time: whoever holds the old one keeps it as it was.
  private splice(at: number, count: number, added: StrokeFile): void {
    this.list = [...this.list.slice(0, at), ...added, ...this.list.slice(at + count)];
  }
}
