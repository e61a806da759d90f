// The canvas with its view: sizes, frames, the cursor above it.
import type { Settings } from '../tools/settings';
import { element } from '../panel/dom';
import type { StrokeFile } from '../model/stroke_file';
import { PhotoLayers } from './photo_layers';
import type { Live } from './stroke_layer';
import { clamped, fitted, panned, toPhoto, toScreen, zoomed, type View } from './view_transform';

const restTime = 120; // ms without a new view after which it rests
const panDuringKeys = 0.1; // of the canvas

export interface StageContent {
  settings(): Settings;
  entries(): StrokeFile;
  live(): Live | undefined;
}
// Where the cursor is, px of the canvas; a cross for keys, a ring for pointers.
export interface Cursor {
  readonly x: number;
  readonly y: number;
  readonly isCross: boolean;
}

export class Stage {
  readonly root: HTMLElement;
  readonly canvas = element('canvas', { tabindex: 0, role: 'application' });
  readonly layers: PhotoLayers;
  cursor: Cursor | undefined;
  private readonly over = element('canvas', { class: 'paint-over', 'aria-hidden': 'true' });
  private view_: View = { scale: 1, x: 0, y: 0 };
  private isFitted = true;
  private frame = 0;
  private pictureIsOld = true;
  private movedAt = -Infinity; // ms
  private restTimer: ReturnType<typeof setTimeout> | undefined;
  private readonly observer = new ResizeObserver(() => this.resized());

  constructor(photo: ImageBitmap, private readonly content: StageContent, private readonly onView: () => void) {
    this.layers = new PhotoLayers(photo);
    this.root = element('div', { class: 'paint-stage' }, this.canvas, this.over);
    this.observer.observe(this.root);
  }

  get view(): View {
    return this.view_;
  }
  get ratio(): number {
    return window.devicePixelRatio || 1;
  }
  get size(): { width: number; height: number } {
    return { width: this.root.clientWidth, height: this.root.clientHeight };
  }
  // Of a place of the canvas, or of the mouse event's client coordinates.
  photoAt(x: number, y: number): [number, number] {
    return toPhoto(this.view_, x, y);
  }
  screenAt(x: number, y: number): [number, number] {
    return toScreen(this.view_, x, y);
  }

  pan(dx: number, dy: number): void {
    this.setView(panned(this.view_, dx, dy, this.layers.size, this.size));
  }
  panByShare(x: number, y: number): void {
    this.pan(x * panDuringKeys * this.size.width, y * panDuringKeys * this.size.height);
  }
  zoom(factor: number, x = this.size.width / 2, y = this.size.height / 2): void {
    this.setView(zoomed(this.view_, factor, x, y, this.layers.size, this.size));
  }
  zoomTo(scale: number): void {
    this.zoom(scale / this.view_.scale);
  }
  fit(): void {
    this.setView(fitted(this.layers.size, this.size));
    this.isFitted = true;
  }

  // Draws with the next frame. `onlyCursor`: the pictures have not changed.
  redraw(onlyCursor = false): void {
    if (!onlyCursor) this.pictureIsOld = true;
    if (!this.frame) this.frame = requestAnimationFrame(() => this.drawFrame());
  }
  // Draws at once, for whoever reads pixels.
  flush(): void {
    cancelAnimationFrame(this.frame);
    this.drawFrame();
  }
  destroy(): void {
    this.observer.disconnect();
    cancelAnimationFrame(this.frame);
    clearTimeout(this.restTimer);
    this.root.remove();
  }

  private setView(view: View): void {
    this.view_ = view;
    this.movedAt = performance.now();
    this.isFitted = false;
    this.redraw();
    this.onView();
  }
  private resized(): void {
    const { width, height } = this.size;
    if (width === 0 || height === 0) return;
    for (const canvas of [this.canvas, this.over]) {
      canvas.width = Math.round(width * this.ratio);
      canvas.height = Math.round(height * this.ratio);
    }
    this.view_ = this.isFitted ? fitted(this.layers.size, this.size) : clamped(this.view_, this.layers.size, this.size);
    this.flush(); // a canvas of a new size is empty
    this.onView();
  }

  private drawFrame(): void {
    this.frame = 0;
    if (this.pictureIsOld) {
      const { settings, entries, live } = this.content;
      const context = this.canvas.getContext('2d')!;
      const isMoving = performance.now() - this.movedAt < restTime;
      const isRough = this.layers.draw(context, this.view_, this.ratio, entries(), live(), settings(), isMoving);
      this.pictureIsOld = false;
      clearTimeout(this.restTimer);
      if (isRough) this.restTimer = setTimeout(() => this.redraw(), restTime);
    }
    this.drawCursor();
  }

  private drawCursor(): void {
    const context = this.over.getContext('2d')!;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, this.over.width, this.over.height);
    if (!this.cursor) return;
    const { x, y, isCross } = this.cursor;
    const { tool, width, fill } = this.content.settings();
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    const twice = (draw: () => void) => {
      for (const [style, line] of [['#000a', 3.5], ['#fff', 1.5]] as const) {
        context.strokeStyle = style;
        context.lineWidth = line;
        context.beginPath();
        draw();
        context.stroke();
      }
    };
    const hasRing = tool === 'brush' || tool === 'line' || tool === 'eraser';
    const radius = Math.max(2.5, (width / 2) * this.view_.scale);
    if (hasRing) twice(() => context.arc(x, y, radius, 0, 2 * Math.PI));
    if (isCross || tool === 'region') {
      twice(() => {
        for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
          context.moveTo(x + 4 * dx, y + 4 * dy);
          context.lineTo(x + 12 * dx, y + 12 * dy);
        }
      });
    }
    if (tool === 'region' || (hasRing && tool !== 'eraser')) {
      context.fillStyle = fill.color ?? '#8a8f94';
      context.beginPath();
      context.arc(x, y, tool === 'region' ? 3 : 2, 0, 2 * Math.PI);
      context.fill();
      context.strokeStyle = '#fffc';
      context.lineWidth = 1;
      context.stroke();
    }
  }
}
