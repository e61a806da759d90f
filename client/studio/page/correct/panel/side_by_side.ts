// Photo, coloured photo and scene side by side, each of which can be left out.
import { h } from '../../dom';

export type Pane = 'photo' | 'color' | 'scene';
const names: [Pane, string][] = [['photo', 'Photo'], ['color', 'Coloured'], ['scene', 'Scene']];

export class SideBySide {
  readonly buttons = h('div', { class: 'co-group', role: 'group', 'aria-label': 'Side by side' });
  readonly root: HTMLElement;

  constructor(private readonly panes: Record<Pane, HTMLElement>) {
    this.root = h('div', { class: 'co-panes' }, panes.photo, panes.color, panes.scene);
    for (const [pane, name] of names) {
      this.buttons.append(h('button', { type: 'button', 'aria-pressed': 'true', 'data-pane': pane, onclick: () => this.toggle(pane) }, name));
    }
  }

  // One of them stays.
  toggle(pane: Pane): void {
    const shown = names.filter(([name]) => !this.panes[name].hidden);
    if (!this.panes[pane].hidden && shown.length === 1) return;
    this.panes[pane].hidden = !this.panes[pane].hidden;
    this.buttons.querySelector(`[data-pane=${pane}]`)!.setAttribute('aria-pressed', String(!this.panes[pane].hidden));
  }
}
