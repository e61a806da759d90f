// Pictures of the views and their maps, fetched once each, a few at a time.
import { getMap, getPhoto, type MapName } from '../calls';
import type { Parts, Shader } from './shading';

// Whose colours: those of a version of the scene, of a job that tries a change of it, or without corrections.
export interface Colors { readonly run: string; readonly trial: string; readonly isBase: boolean }

const atOnce = 3;

export class PictureStore {
  private readonly known = new Map<string, Promise<ImageBitmap | null>>();
  private readonly waiting: (() => void)[] = [];
  private readonly end = new AbortController();
  private busy = 0;

  constructor(private readonly run: string, private readonly shader: Shader) {}

  // Parts of a view for a look at it. `side`: longer side, px. Throws AbortError if they were forgotten meanwhile.
  async parts(view: string, side: number, colors: Colors, wants: { source: boolean; pull: boolean }): Promise<Parts> {
    const { run, trial, isBase } = colors;
    const map = (name: MapName, of: string): Promise<ImageBitmap | null> =>
      this.get(`${name} ${run} ${of} ${side} ${view}`, () => getMap(run, name, view, side, of, this.end.signal));
    const [photo, color, source, pull] = await Promise.all([
      this.get(`photo ${side} ${view}`, () => getPhoto(this.run, view, side, this.end.signal)),
      isBase ? map('base', '') : map('color', trial),
      wants.source ? map('source', trial) : null,
      wants.pull && trial ? map('pull', trial) : null,
    ]);
    // A closed bitmap has no width.
    if ([photo, color, source, pull].some((bitmap) => bitmap?.width === 0)) throw new DOMException('forgotten', 'AbortError');
    return { photo: photo!, color, source, pull };
  }

  // Forgets the maps of all versions and trials but these.
  keep(runs: readonly string[], trials: readonly string[]): void {
    for (const [key, bitmap] of this.known) {
      const [name, run, trial] = key.split(' ');
      if (name === 'photo' || (runs.includes(run!) && (trial === '' || trials.includes(trial!)))) continue;
      this.known.delete(key);
      void bitmap.then((one) => {
        if (!one) return;
        this.shader.forget(one);
        one.close();
      }, () => undefined);
    }
  }

  destroy(): void {
    this.end.abort();
    this.keep([], []);
  }

  private get(key: string, load: () => Promise<ImageBitmap | null>): Promise<ImageBitmap | null> {
    let found = this.known.get(key);
    if (!found) {
      found = this.inTurn(load);
      this.known.set(key, found);
      found.catch(() => this.known.delete(key)); // so that it may be tried again
    }
    return found;
  }

  private async inTurn<T>(work: () => Promise<T>): Promise<T> {
    if (this.busy >= atOnce) await new Promise<void>((go) => this.waiting.push(go));
    ++this.busy;
    try {
      return await work();
    } finally {
      --this.busy;
      this.waiting.shift()?.();
    }
  }
}
