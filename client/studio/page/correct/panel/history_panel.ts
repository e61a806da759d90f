// The corrections by name, each with its place before and after; each can be looked at without, and removed.
import { button, h, replace } from '../../dom';
import type { Correction } from '../calls';
import { correctionNames } from '../model/names';
import { section } from './controls';

export interface HistoryHooks {
  remove(id: string): void;
  without(id: string | null): void; // shows the scene without it
  // Draws the place of a correction before and after.
  draw(correction: Correction, before: HTMLCanvasElement, after: HTMLCanvasElement): void;
}

export class HistoryPanel {
  readonly root: HTMLElement;
  private readonly list = h('ol', { class: 'co-history' });
  private readonly none = h('p', { class: 'soft small' }, 'None yet.');
  private without: string | null = null;
  private readonly marks: HTMLButtonElement[] = [];

  constructor(private readonly hooks: HistoryHooks) {
    this.root = section('Corrections', this.none, this.list);
  }

  show(corrections: readonly Correction[]): void {
    this.none.hidden = corrections.length > 0;
    this.marks.length = 0;
    const names = correctionNames(corrections);
    replace(this.list, ...corrections.map((correction, i) => {
      const canvas = (what: string): HTMLCanvasElement =>
        h('canvas', { width: 72, height: 72, role: 'img', 'aria-label': `${names[i]}, ${what}` });
      const [before, after] = [canvas('before'), canvas('after')];
      const compare = button('Without it', () => this.setWithout(this.without === correction.id ? null : correction.id),
        { 'aria-pressed': 'false', 'data-id': correction.id, 'aria-label': `Show without: ${names[i]}` });
      this.marks.push(compare);
      this.hooks.draw(correction, before, after);
      return h('li', { 'data-id': correction.id }, h('span', { class: 'co-pair' }, before, after),
        h('span', { class: 'co-what' }, h('span', {}, names[i]!), h('span', { class: 'row' }, compare,
          button('Remove', () => this.hooks.remove(correction.id), { 'aria-label': `Remove: ${names[i]}`, class: 'co-remove' }))));
    }));
    if (this.without !== null && !corrections.some(({ id }) => id === this.without)) this.without = null;
    this.mark();
  }
  setWithout(id: string | null): void {
    if (this.without === id) return;
    this.without = id;
    this.mark();
    this.hooks.without(id);
  }

  private mark(): void {
    for (const button of this.marks) button.setAttribute('aria-pressed', String(button.dataset.id === this.without));
  }
}
