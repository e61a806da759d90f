// One picture, on which the user points: the picture below, strokes and the brush above. Places are px of the
// picture, whatever its size on the screen.
import { h } from '../../dom';
import type { SceneView } from '../calls';
import type { Stroke } from '../model/strokes';
import type { Look, Parts, Shader } from './shading';

export type Tool = 'brush' | 'gray' | 'pick';
export interface PictureHooks {
  stroke(path: [number, number][]): void;
  point(tool: 'gray' | 'pick', x: number, y: number): void;
}

const step = 0.01; // of the width: what an arrow key moves the brush by
const keys: Record<string, [number, number]> = {
  ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1],
};

export class Picture {
  readonly root: HTMLElement;
  private readonly below = h('canvas', { width: 16, height: 16 });
  private readonly above = h('canvas', { width: 16, height: 16, tabindex: 0, role: 'application' });
  private readonly picture = this.below.getContext('2d')!;
  private readonly marks = this.above.getContext('2d')!;
  private readonly watch = new ResizeObserver(() => this.fit());
  private view: SceneView | null = null;
  private parts: Parts | null = null;
  private look: Look | null = null;
  private tool: Tool = 'brush';
  private strokes: readonly Stroke[] = [];
  private brush = { width: 20, color: '#ffffff' };
  private path: [number, number][] | null = null;
  private cursor: [number, number] | null = null;

  constructor(private readonly label: string, private readonly shader: Shader, private readonly hooks: PictureHooks) {
    this.root = h('figure', { class: 'co-picture' }, h('div', { class: 'co-canvases' }, this.below, this.above), h('figcaption', {}, label));
    this.above.addEventListener('pointerdown', (event) => this.down(event));
    this.above.addEventListener('pointermove', (event) => this.move(event));
    this.above.addEventListener('pointerup', () => this.finish());
    this.above.addEventListener('pointercancel', () => {
      this.path = null;
      this.mark();
    });
    this.above.addEventListener('pointerleave', () => {
      if (this.path) return;
      this.cursor = null;
      this.mark();
    });
    this.above.addEventListener('keydown', (event) => this.key(event));
    this.above.addEventListener('blur', () => {
      this.cursor = null;
      this.mark();
    });
    this.watch.observe(this.below);
  }

  show(view: SceneView, parts: Parts | null, look: Look): void {
    if (view !== this.view) {
      this.path = null;
      this.above.setAttribute('aria-label', `${this.label}, ${view.name}. Draw with the pointer, or move the brush with the arrow keys and press Enter.`);
      this.root.style.setProperty('--aspect', `${view.width} / ${view.height}`);
    }
    this.view = view;
    this.parts = parts;
    this.look = look;
    this.fit();
  }
  setTool(tool: Tool, brush: { width: number; color: string }): void {
    this.tool = tool;
    this.brush = brush;
    this.above.dataset.tool = tool;
    this.mark();
  }
  setStrokes(strokes: readonly Stroke[]): void {
    this.strokes = strokes;
    this.mark();
  }
  setLook(look: Look): void {
    this.look = look;
    this.draw();
  }
  destroy(): void {
    this.watch.disconnect();
  }

  // Gives the canvases the size that they have on the screen, at most that of the picture.
  private fit(): void {
    if (!this.view || !this.below.clientWidth) return;
    const ratio = Math.min(devicePixelRatio || 1, this.view.width / this.below.clientWidth);
    const width = Math.max(1, Math.round(this.below.clientWidth * ratio));
    const height = Math.max(1, Math.round((width * this.view.height) / this.view.width));
    for (const canvas of [this.below, this.above]) {
      if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    }
    this.draw();
    this.mark();
  }
  private draw(): void {
    if (this.parts && this.look) this.shader.draw(this.picture, this.parts, this.look);
    else this.picture.clearRect(0, 0, this.below.width, this.below.height);
  }

  private place(event: { clientX: number; clientY: number }): [number, number] {
    const box = this.above.getBoundingClientRect();
    return [((event.clientX - box.left) / box.width) * this.view!.width, ((event.clientY - box.top) / box.height) * this.view!.height];
  }
  private down(event: PointerEvent): void {
    if (!this.view || event.button !== 0 || !event.isPrimary) return;
    const at = this.place(event);
    this.cursor = at;
    if (this.tool !== 'brush') {
      this.hooks.point(this.tool, ...at);
      return;
    }
    this.above.setPointerCapture(event.pointerId);
    this.path = [at];
    this.mark();
  }
  private move(event: PointerEvent): void {
    if (!this.view) return;
    for (const one of this.path && event.getCoalescedEvents?.().length ? event.getCoalescedEvents() : [event]) {
      this.cursor = this.place(one);
      this.path?.push(this.cursor);
    }
    this.mark();
  }
  private finish(): void {
    const path = this.path;
    this.path = null;
    if (path) this.hooks.stroke(path);
    this.mark();
  }
  private key(event: KeyboardEvent): void {
    if (!this.view || event.ctrlKey || event.metaKey || event.altKey) return;
    const { width, height } = this.view;
    const direction = keys[event.key];
    if (direction) {
      const [x, y] = this.cursor ?? [width / 2, height / 2];
      const by = step * width * (event.shiftKey ? 5 : 1);
      this.cursor = [Math.min(width - 1, Math.max(0, x + by * direction[0])), Math.min(height - 1, Math.max(0, y + by * direction[1]))];
    } else if ((event.key === 'Enter' || event.key === ' ') && this.cursor) {
      if (this.tool === 'brush') this.hooks.stroke([this.cursor]);
      else this.hooks.point(this.tool, ...this.cursor);
    } else {
      return;
    }
    event.preventDefault();
    this.mark();
  }

  private mark(): void {
    if (!this.view) return;
    const { marks, above } = this;
    const scale = above.width / this.view.width;
    marks.setTransform(1, 0, 0, 1, 0, 0);
    marks.clearRect(0, 0, above.width, above.height);
    marks.setTransform(scale, 0, 0, scale, 0, 0);
    marks.lineCap = marks.lineJoin = 'round';
    for (const stroke of this.strokes) {
      const color = stroke.color ?? '#8a8f94';
      if ('line' in stroke) this.line(stroke.line, stroke.width, color, scale);
      else this.line([[stroke.x, stroke.y]], 2 * stroke.radius, color, scale);
    }
    if (this.path) this.line(this.path, this.brush.width, this.brush.color, scale);
    else if (this.cursor) this.ring(this.cursor, this.tool === 'brush' ? this.brush.width / 2 : 6 / scale, scale);
  }
  private line(points: readonly (readonly [number, number])[], width: number, color: string, scale: number): void {
    const { marks } = this;
    const trace = new Path2D();
    trace.moveTo(...(points[0] as [number, number]));
    for (const [x, y] of points) trace.lineTo(x, y);
    for (const [style, extra] of [['#000c', 3 / scale], ['#fffd', 1.6 / scale], [color, 0]] as const) {
      marks.strokeStyle = style;
      marks.lineWidth = width + extra;
      marks.stroke(trace);
    }
  }
  private ring([x, y]: readonly [number, number], radius: number, scale: number): void {
    const { marks } = this;
    for (const [style, extra] of [['#000', 1.2 / scale], ['#fff', 0]] as const) {
      marks.strokeStyle = style;
      marks.lineWidth = 1.4 / scale;
      marks.beginPath();
      marks.arc(x, y, radius + extra, 0, 2 * Math.PI);
      marks.stroke();
    }
  }
}
