// What the shades of a picture mean.
import { h, replace } from '../../dom';
import { sourceShades, type Mode } from '../view/shading';

const shades: Partial<Record<Mode, [string, string][]>> = {
  source: [[sourceShades.seen, 'seen in a key photo'], [sourceShades.inferred, 'inferred from it'], [sourceShades.guessed, 'guessed']],
  pull: [['#ffe673', 'changes most'], ['#d1540f', 'changes a little'], ['#777', 'stays']],
};

export class Legend {
  readonly root = h('p', { class: 'co-legend', hidden: true });

  show(mode: Mode): void {
    replace(this.root, ...(shades[mode] ?? []).map(([color, text]) => {
      const patch = h('i', {});
      patch.style.backgroundColor = color;
      return h('span', {}, patch, text);
    }));
    this.root.hidden = !shades[mode];
  }
}
