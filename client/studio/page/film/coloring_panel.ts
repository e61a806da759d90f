// The side of the film's page: its coloured frames and parts, how each is coloured, and what is proposed.
import { keepPicture } from '../api';
import { button, h, problem, replace } from '../dom';
import { frameUrl } from './film_api';
import type { Coloring, FilmPlan, PartColoring, Way } from './film_plan';
import type { Proposal } from './timeline';
import { clockOf } from './timeline_model';

export type List = 'keys' | 'parts';
export interface PanelEvents {
  seek: (frame: number) => void;
  pick: (list: List, index: number) => void;
  paint: (list: List, index: number) => void;
  add: (list: List) => void;
  takeProposal: (frame: number) => void;
}
export interface PanelState {
  readonly set: string;
  readonly now: number;
  readonly picked: { readonly list: List; readonly index: number } | null;
  readonly proposals: readonly Proposal[];
  readonly allowsParts: boolean; // only a coloured film without poses has parts
  readonly whyNoParts: string;
  readonly colored: ((frame: number) => string) | null; // address of a frame in colour
}

const ways: [Way, string][] = [['automatic', 'Automatic'], ['strokes', 'Paint'], ['picture', 'A picture I coloured']];
const wayWords: Record<Way, string> = {
  automatic: 'automatic colours', strokes: 'painted', picture: 'your picture', kept: 'coloured',
};

const howOf = (one: Coloring): string => one.way === 'kept' ? (one.automatic ? 'automatic colours' : 'coloured by you')
  : one.way === 'strokes' ? (one.strokes?.length ? `painted, ${one.strokes.length === 1 ? 'one stroke' : `${one.strokes.length} strokes`}` : 'not painted yet')
    : one.way === 'picture' ? one.pictureName ?? 'no picture yet' : wayWords[one.way];

export class ColoringPanel {
  readonly root = h('div', { class: 'film-panel' });

  constructor(private readonly plan: FilmPlan, private readonly on: PanelEvents) {}

  update(state: PanelState): void {
    const focused = (document.activeElement as HTMLElement | null)?.id;
    replace(this.root,
      this.list('keys', 'Coloured frames', state),
      ...this.proposals(state),
      h('p', {}, button('Colour this frame, too', () => this.on.add('keys'), { id: 'add-key', disabled: this.plan.keys.some((key) => key.frame === state.now) })),
      ...(state.allowsParts ? [
        this.plan.parts.length ? this.list('parts', 'Parts in other colours', state) : null,
        h('p', {}, button('Other colours for a part here', () => this.on.add('parts'), { id: 'add-part' })),
      ] : [state.whyNoParts ? h('p', { class: 'soft small' }, state.whyNoParts) : null]).filter((one) => one !== null));
    if (focused) document.getElementById(focused)?.focus({ preventScroll: true });
  }

  private list(list: List, title: string, state: PanelState): HTMLElement {
    const items: readonly (Coloring | PartColoring)[] = this.plan[list];
    return h('section', { 'aria-label': title }, h('h2', {}, title),
      h('ul', { class: 'film-items' }, ...items.map((one, i) => this.item(list, one, i, state))));
  }

  private item(list: List, one: Coloring | PartColoring, index: number, state: PanelState): HTMLElement {
    const isPicked = state.picked?.list === list && state.picked.index === index;
    const { times, names } = this.plan.film;
    const at = clockOf(times[one.frame]!);
    const span = 'begin' in one ? `${clockOf(times[one.begin]!)} to ${clockOf(times[one.end + 1] ?? times[one.end]!)}` : '';
    const head = h('button', { type: 'button', class: 'film-item-head', id: `${list}-${index}`, 'aria-expanded': String(isPicked), onclick: () => this.on.pick(list, index) },
      h('img', { src: one.way === 'kept' && state.colored ? state.colored(one.frame) : frameUrl(state.set, names[one.frame]!, 120, true), alt: '', loading: 'lazy' }),
      h('span', {}, h('span', { class: 'film-item-time' }, span || at), h('span', { class: 'small soft' }, span ? `${howOf(one)}, from ${at}` : howOf(one))));
    return h('li', { class: isPicked ? 'picked' : '' }, head, isPicked && this.detail(list, one, index, state));
  }

  private detail(list: List, one: Coloring, index: number, state: PanelState): HTMLElement {
    const trouble = h('div', {});
    const name = this.plan.film.names[one.frame]!;
    const id = `${list}-${index}-way`;
    const select = h('select', { id, onchange: () => {
      const way = select.value as Way;
      if (way === 'kept') return;
      this.plan.color(list, index, { way });
      if (way === 'strokes') this.on.paint(list, index);
    } }, one.way === 'kept' && h('option', { value: 'kept', selected: true }, 'As it is'),
    ...ways.map(([value, text]) => h('option', { value, selected: value === one.way }, text)));
    const bring = async (event: Event): Promise<void> => {
      const file = (event.currentTarget as HTMLInputElement).files?.[0];
      if (!file) return;
      try {
        const kept = await keepPicture(state.set, file);
        this.plan.color(list, index, { way: 'picture', picture: kept.picture, pictureName: file.name });
      } catch (error) {
        replace(trouble, problem((error as Error).message));
      }
    };
    const fileId = `${list}-${index}-picture`;
    return h('div', { class: 'film-item-detail' },
      h('p', { class: 'row' }, h('label', { for: id }, 'Its colours'), select),
      one.way === 'strokes' && h('p', {}, button(one.strokes?.length ? 'Go on painting' : 'Paint on the frame', () => this.on.paint(list, index), { id: `${list}-${index}-paint` })),
      one.way === 'picture' && h('p', { class: 'row' },
        h('a', { class: 'button', href: frameUrl(state.set, name, 0, true), download: name.replace(/\.[^.]*$/, '.jpg') }, 'Save the frame'),
        h('span', { class: 'file-choice' },
          h('input', { type: 'file', accept: 'image/*', id: fileId, class: 'said', onchange: (event) => void bring(event) }),
          h('label', { for: fileId, class: 'button' }, 'Bring the coloured picture'))),
      trouble,
      list === 'parts' && h('p', { class: 'soft small' }, 'Drag its ends in the timeline. Its colours count from there to there, and nowhere else.'),
      (list === 'parts' || this.plan.keys.length > 1)
        && h('p', {}, button('Remove', () => this.plan.remove(list, index), { class: 'quiet', id: `${list}-${index}-remove` })));
  }

  private proposals(state: PanelState): HTMLElement[] {
    const open = state.proposals.filter(({ frame }) => !this.plan.keys.some((key) => key.frame === frame));
    return open.length === 0 ? [] : [h('section', { class: 'film-proposals', 'aria-label': 'Worth colouring, too' },
      h('h2', {}, 'Worth colouring, too'),
      h('ul', { class: 'film-items' }, ...open.map(({ frame, text }) => h('li', {},
        h('button', { type: 'button', class: 'film-item-head proposal', id: `proposal-${frame}`, onclick: () => this.on.takeProposal(frame) },
          h('img', { src: frameUrl(state.set, this.plan.film.names[frame]!, 120, true), alt: '', loading: 'lazy' }),
          h('span', {}, h('span', { class: 'film-item-time' }, clockOf(this.plan.film.times[frame]!)), h('span', { class: 'small soft' }, text)))))))];
  }
}
