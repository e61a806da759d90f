// All photos side by side; one is chosen. Pictures are drawn when they come into sight.
import { h, replace } from '../../dom';
import type { SceneView } from '../calls';
import type { Look, Parts, Shader } from './shading';

export const stripSide = 240; // px
const delay = 150; // ms: the photos follow when a slider rests

interface Cell { readonly view: SceneView; readonly button: HTMLButtonElement; readonly canvas: HTMLCanvasElement; readonly note: HTMLElement; parts: Parts | null; isSeen: boolean }

export class Strip {
  readonly root = h('ul', { class: 'co-strip', 'aria-label': 'Photos' });
  private readonly cells = new Map<string, Cell>();
  private later: ReturnType<typeof setTimeout> | undefined;
  private readonly sight = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) {
      const cell = this.cells.get((target as HTMLElement).dataset.view!)!;
      cell.isSeen = isIntersecting;
      if (isIntersecting) this.hooks.seen(cell.view.name);
    }
  }, { root: this.root, rootMargin: '0px 200px' });

  constructor(views: readonly SceneView[], key: string, private readonly shader: Shader,
    private readonly hooks: { choose(view: string): void; seen(view: string): void }) {
    for (const view of views) {
      const height = 96;
      const canvas = h('canvas', { width: Math.round((height * view.width) / view.height), height });
      const note = h('span', { class: 'co-note small' });
      const button = h('button', { type: 'button', 'aria-pressed': 'false', 'data-view': view.name, onclick: () => hooks.choose(view.name) },
        canvas, h('span', { class: 'name' }, view.name === key ? `★ ${view.name}` : view.name, view.name === key && h('span', { class: 'said' }, ' key photo')), note);
      this.cells.set(view.name, { view, button, canvas, note, parts: null, isSeen: false });
      this.root.append(h('li', {}, button));
      this.sight.observe(button);
    }
  }

  isSeen(view: string): boolean {
    return this.cells.get(view)?.isSeen ?? false;
  }
  choose(view: string): void {
    for (const [name, { button }] of this.cells) {
      button.setAttribute('aria-pressed', String(name === view));
      if (name !== view) continue;
      // Not scrollIntoView, which moves the page, too.
      const box = this.root.getBoundingClientRect();
      const own = button.getBoundingClientRect();
      this.root.scrollLeft += own.left + own.width / 2 - box.left - box.width / 2;
    }
  }
  setParts(view: string, parts: Parts, look: Look): void {
    const cell = this.cells.get(view)!;
    cell.parts = parts;
    this.draw(cell, look);
  }
  setNote(view: string, text: string): void {
    const cell = this.cells.get(view)!;
    if (cell.note.textContent !== text) replace(cell.note, text);
  }
  setLook(look: Look): void {
    clearTimeout(this.later);
    this.later = setTimeout(() => {
      for (const cell of this.cells.values()) if (cell.isSeen) this.draw(cell, look);
    }, delay);
  }
  destroy(): void {
    clearTimeout(this.later);
    this.sight.disconnect();
  }

  private draw(cell: Cell, look: Look): void {
    if (cell.parts) this.shader.draw(cell.canvas.getContext('2d')!, cell.parts, look);
  }
}
