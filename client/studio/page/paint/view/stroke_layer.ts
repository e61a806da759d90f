// The strokes on a canvas of the size of the screen. Entries are drawn once: what comes is added, and when the newest go
// (undo), the older ones are still there on a canvas of their own.
import type { Line, StrokeFile } from '../model/stroke_file';
import type { Size } from '../raster/mask';
import { canvasOf } from './canvas';
import { drawEntries, pathOfLine, strokeLine, type Paints } from './stroke_drawing';
import { toPhoto, type View } from './view_transform';

// What the tool in use adds to the strokes.
export interface Live {
  readonly entries: StrokeFile;
  readonly eraser: readonly Line[];
}
export interface StrokeRequest {
  readonly view: View;
  readonly ratio: number; // device px a CSS px
  readonly canvas: Size; // device px
  readonly entries: StrokeFile;
  readonly live: Live | undefined;
  readonly isSolid: boolean;
  readonly isMoving: boolean; // the view is being moved: an older picture of many strokes will do
  readonly paints: (context: CanvasRenderingContext2D) => Paints;
}
export interface StrokePicture {
  readonly canvas: HTMLCanvasElement;
  readonly view: View; // that it was drawn for, if not that of the request
}

const slowDrawing = 150; // entries
const newest = 64; // entries that are not on the canvas of the older ones

const isBeginning = (before: StrokeFile, now: StrokeFile): boolean =>
  before.length <= now.length && before.every((entry, i) => entry === now[i]);

// A canvas with the first entries of a list.
class Sheet {
  readonly canvas: HTMLCanvasElement;
  readonly context: CanvasRenderingContext2D;
  entries: StrokeFile = [];

  constructor() {
    [this.canvas, this.context] = canvasOf(1, 1);
  }
  clear({ width, height }: Size): void {
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    this.context.setTransform(1, 0, 0, 1, 0, 0);
    this.context.clearRect(0, 0, width, height);
    this.entries = [];
  }
  copy(other: Sheet): void {
    this.clear(other.canvas);
    this.context.drawImage(other.canvas, 0, 0);
    this.entries = other.entries;
  }
}

export class StrokeLayer {
  private readonly older = new Sheet();
  private readonly all = new Sheet();
  private readonly work = new Sheet();
  private drawnFor: { view: View; key: string } | undefined;

  forget(): void {
    this.drawnFor = undefined;
  }

  picture(request: StrokeRequest): StrokePicture {
    const { view, entries, live } = request;
    const key = [request.ratio, request.canvas.width, request.canvas.height, request.isSolid].join();
    const before = this.drawnFor;
    if (before?.key !== key || before.view !== view) {
      const willDo = request.isMoving && !live && before?.key === key && this.all.entries === entries;
      if (willDo && entries.length > slowDrawing) return { canvas: this.all.canvas, view: before.view };
      this.older.clear(request.canvas);
      this.all.clear(request.canvas);
      this.drawnFor = { view, key };
    }
    if (this.all.entries !== entries) this.bringUp(request);
    if (!live) return { canvas: this.all.canvas, view };
    this.work.copy(this.all);
    this.add(this.work, live.entries, request);
    const { context } = this.work;
    context.globalCompositeOperation = 'destination-out';
    context.strokeStyle = '#000';
    for (const line of live.eraser) strokeLine(context, pathOfLine(line), line.width ?? 1);
    context.globalCompositeOperation = 'source-over';
    return { canvas: this.work.canvas, view };
  }

  private bringUp(request: StrokeRequest): void {
    const { entries } = request;
    const old = entries.slice(0, Math.max(0, entries.length - newest));
    if (!isBeginning(this.older.entries, entries)) this.older.clear(request.canvas);
    if (old.length > this.older.entries.length + newest) {
      this.add(this.older, old.slice(this.older.entries.length), request);
      this.older.entries = old;
    }
    if (!isBeginning(this.all.entries, entries)) this.all.copy(this.older);
    this.add(this.all, entries.slice(this.all.entries.length), request);
    this.all.entries = entries;
  }

  private add({ context }: Sheet, entries: StrokeFile, { view, ratio, canvas, paints }: StrokeRequest): void {
    context.setTransform(ratio * view.scale, 0, 0, ratio * view.scale, ratio * view.x, ratio * view.y);
    const [left, top] = toPhoto(view, 0, 0);
    const [right, bottom] = toPhoto(view, canvas.width / ratio, canvas.height / ratio);
    drawEntries(context, entries, { left, top, right, bottom }, paints(context));
  }
}
