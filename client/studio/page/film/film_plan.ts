// What is wanted of a film: its coloured frames and its parts in other colours, with undo. No page in it.
import { serializeStrokes, type StrokeFile } from '../paint/model/stroke_file';
import type { FrameColor, JobTimeline } from './film_api';
import { frameOfName, newSpan, withEdge, type Edge, type FilmTimes, type Part } from './timeline_model';

export type Way = 'automatic' | 'strokes' | 'picture' | 'kept';
export interface Coloring {
  readonly frame: number;
  readonly way: Way;
  readonly kept?: number; // place in the list of the job
  readonly automatic?: boolean; // kept: how it was coloured
  readonly strokes?: readonly unknown[];
  readonly picture?: string;
  readonly pictureName?: string;
}
export type PartColoring = Coloring & Part;
interface Wanted { readonly keys: readonly Coloring[]; readonly parts: readonly PartColoring[] }

const isGiven = ({ way, strokes, picture }: Coloring): boolean =>
  way === 'strokes' ? (strokes?.length ?? 0) > 0 : way === 'picture' ? !!picture : true;

export class FilmPlan {
  private now: Wanted;
  private readonly before: Wanted;
  private past: Wanted[] = [];
  private future: Wanted[] = [];

  constructor(readonly film: FilmTimes, first: Wanted, private readonly changed: () => void) {
    this.now = this.before = first;
  }

  // The coloured frames that a job has.
  static ofJob(film: FilmTimes, job: JobTimeline, changed: () => void): FilmPlan {
    const place = (view: string): number => Math.max(0, frameOfName(film.names, view));
    const last = film.times.length - 1;
    const keys = job.keys.map(({ view, automatic }, kept) => ({ frame: place(view), way: 'kept' as const, kept, automatic }));
    const parts = job.parts.map(({ view, automatic, begin_s, end_s }, kept) => {
      const inside = film.times.map((time, i) => [time, i] as const)
        .filter(([time]) => time >= (begin_s ?? -1) - 1e-6 && time <= (end_s ?? Infinity) + 1e-6);
      return { frame: place(view), way: 'kept' as const, kept, automatic,
        begin: inside[0]?.[1] ?? 0, end: inside[inside.length - 1]?.[1] ?? last };
    });
    return new FilmPlan(film, { keys, parts }, changed);
  }

  get keys(): readonly Coloring[] { return this.now.keys; }
  get parts(): readonly PartColoring[] { return this.now.parts; }
  get canUndo(): boolean { return this.past.length > 0; }
  get canRedo(): boolean { return this.future.length > 0; }

  private set(next: Wanted, joins: boolean): void {
    if (!joins) this.past.push(this.now);
    this.future = [];
    this.now = next;
    this.changed();
  }
  undo(): void {
    const last = this.past.pop();
    if (!last) return;
    this.future.push(this.now);
    this.now = last;
    this.changed();
  }
  redo(): void {
    const next = this.future.pop();
    if (!next) return;
    this.past.push(this.now);
    this.now = next;
    this.changed();
  }

  // Returns its place in the list; the one that is there if the frame is coloured already.
  addKey(frame: number, way: Way = 'automatic'): number {
    const there = this.now.keys.findIndex((key) => key.frame === frame);
    if (there >= 0) return there;
    this.set({ ...this.now, keys: [...this.now.keys, { frame, way }] }, false);
    return this.now.keys.length - 1;
  }
  addPart(frame: number, way: Way = 'automatic'): number {
    const span = newSpan(frame, this.now.parts, this.film);
    const there = this.now.parts.findIndex((part) => part.frame === frame && part.begin === span.begin);
    if (there >= 0) return there;
    this.set({ ...this.now, parts: [...this.now.parts, { ...span, frame, way }] }, false);
    return this.now.parts.length - 1;
  }
  // A film has one coloured frame at least.
  remove(list: 'keys' | 'parts', index: number): void {
    if (list === 'keys' && this.now.keys.length < 2) return;
    this.set({ ...this.now, [list]: this.now[list].filter((_, i) => i !== index) }, false);
  }
  // `joins`: a change of the same thing as the one before, which undo takes back with it.
  color(list: 'keys' | 'parts', index: number, coloring: Partial<Coloring>, joins = false): void {
    this.set({ ...this.now, [list]: this.now[list].map((one, i) => {
      if (i !== index) return one;
      const { kept: _, automatic: __, ...rest } = one;
      return { ...rest, ...coloring };
    }) }, joins);
  }
  // Returns whether that changes it.
  moveEdge(index: number, edge: Edge, frame: number, joins: boolean): boolean {
    const parts = withEdge(this.now.parts, index, edge, frame, this.film);
    if (parts.every((part, i) => part[edge] === this.now.parts[i]![edge])) return false;
    this.set({ ...this.now, parts }, joins);
    return true;
  }

  isChanged(): boolean { return JSON.stringify(this.now) !== JSON.stringify(this.before); }

  // What is missing, for the user; empty: nothing.
  missing(): string {
    const open = [...this.now.keys, ...this.now.parts].find((one) => !isGiven(one));
    if (!open) return '';
    return open.way === 'picture' ? 'Bring the picture that you coloured first.' : 'Paint something on the frame first.';
  }

  toBody(): { keys: FrameColor[]; parts: FrameColor[] } {
    const entry = (one: Coloring): FrameColor => one.way === 'kept' ? { kept: one.kept! } : {
      view: this.film.names[one.frame]!, color: one.way === 'strokes' ? 'automatic' : one.way, // strokes lie above automatic colours
      ...(one.way === 'strokes' ? { strokes: serializeStrokes(one.strokes as StrokeFile) } : {}),
      ...(one.way === 'picture' ? { picture: one.picture } : {}),
    };
    return {
      keys: this.now.keys.map(entry),
      parts: this.now.parts.map((part) => ({
        ...entry(part), begin_s: this.film.times[part.begin]!, end_s: this.film.times[part.end]!,
      })),
    };
  }
}
