// Strokes that are not applied yet: they are tried on the service, which tells what they touch.
import { cancelJob, getJob } from '../api';
import { tryChange, type Change, type NewStroke } from './calls';
import type { Stroke } from './model/strokes';
import { isFinished } from '../words';

const between = 150; // ms
const pause = (ms: number): Promise<void> => new Promise((done) => setTimeout(done, ms));

// Tries a change of a scene. Returns the job, whose maps are there then; null if `isWanted` says no any more.
export const tried = async (run: string, change: Change, isWanted: () => boolean): Promise<string | null> => {
  let job = await tryChange(run, change);
  while (!isFinished(job.state)) {
    if (!isWanted()) {
      void cancelJob(job.id).catch(() => undefined);
      return null;
    }
    await pause(between);
    job = await getJob(job.id);
  }
  if (job.state !== 'SUCCEEDED') throw new Error(job.error ?? 'The stroke could not be tried.');
  return isWanted() ? job.id : null;
};

export class Draft {
  strokes: Stroke[] = [];
  view = '';
  reach = 1;
  trial = ''; // a job; empty: not tried yet
  private number = 0;

  constructor(private readonly changed: () => void, private readonly failed: (text: string) => void) {}

  get isEmpty(): boolean {
    return this.strokes.length === 0;
  }
  get asNew(): NewStroke {
    return { view: this.view, strokes: this.strokes, reach: Math.round(1000 * this.reach) / 1000 };
  }
  // Strokes on another photo begin anew.
  add(view: string, stroke: Stroke): void {
    this.strokes = view === this.view ? [...this.strokes, stroke] : [stroke];
    this.view = view;
  }
  clear(): void {
    ++this.number;
    this.strokes = [];
    this.trial = '';
    this.reach = 1;
    this.changed();
  }
  restore({ view, strokes, reach }: NewStroke, trial: string): void {
    Object.assign(this, { view, strokes, reach, trial });
    this.changed();
  }
  // Takes back the last stroke.
  undo(run: string): void {
    this.strokes = this.strokes.slice(0, -1);
    if (this.isEmpty) this.clear();
    else void this.try(run);
  }
  async try(run: string): Promise<void> {
    const number = ++this.number;
    this.trial = '';
    this.changed();
    try {
      const trial = await tried(run, { add: this.asNew }, () => number === this.number);
      if (trial === null) return;
      this.trial = trial;
    } catch (error) {
      if (number === this.number) this.failed((error as Error).message);
      return;
    }
    this.changed();
  }
}
