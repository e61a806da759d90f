// Colour of a thing: the colour, the brush, and what a stroke touches before it counts.
import { button, h, replace } from '../../dom';
import { hexAtLuminance } from '../../paint/color/lab';
import { reachInWords, reachOfSlider, sliderOfReach } from '../model/heat';
import type { Fill } from '../model/strokes';
import type { Tool } from '../view/picture';
import { section, slider } from './controls';

export interface BrushHooks {
  changed(): void; // colour, brush or tool
  reach(reach: number): void;
  reached(reach: number): void; // the slider was let go of
  apply(): void;
  discard(): void;
}

const maxRecent = 8;
const settled = 350; // ms

export class BrushPanel {
  readonly root: HTMLElement;
  tool: Tool = 'brush';
  width: number; // px of the picture
  private color = '#a0522d';
  private isNeutral = false;
  private recent: string[] = [];
  private releasing: ReturnType<typeof setTimeout> | undefined;
  private readonly input = h('input', { type: 'color', id: 'co-color', value: this.color });
  private readonly here = h('span', { class: 'co-here', title: 'The colour where it is drawn: the photo gives its brightness' });
  private readonly neutral = button('No colour (grey)', () => this.take({ keep: 'neutral' }), { 'aria-pressed': 'false' });
  private readonly picker = button('Take a colour from the picture', () => this.setTool(this.tool === 'pick' ? 'brush' : 'pick'), { 'aria-pressed': 'false' });
  private readonly swatches = h('div', { class: 'co-swatches', role: 'group', 'aria-label': 'Colours used last' });
  private readonly reachSlider;
  private readonly draft: HTMLElement;
  private readonly says = h('p', { class: 'small', role: 'status' });
  private readonly applies = button('Apply to all photos and the scene', () => this.hooks.apply(), { class: 'main-button', id: 'co-apply' });

  // `pictureWidth`: px, that brushes fit to.
  constructor(pictureWidth: number, private readonly hooks: BrushHooks) {
    const most = Math.max(8, Math.round(pictureWidth * 0.12));
    this.width = Math.max(4, Math.round(pictureWidth * 0.025));
    this.input.addEventListener('input', () => this.take({ color: this.input.value }));
    const width = slider({ id: 'co-width', label: 'Brush', min: 2, max: most, step: 1, value: this.width, text: (value) => `${value} px` },
      { input: (value) => { this.width = value; hooks.changed(); } });
    this.reachSlider = slider(
      { id: 'co-reach', label: 'Reach', min: 0, max: 1, step: 0.01, value: 0.5, text: (value) => reachInWords(reachOfSlider(value)) },
      { input: (value) => hooks.reach(reachOfSlider(value)), release: (value) => this.release(reachOfSlider(value)) });
    this.draft = h('div', { class: 'co-draft', hidden: true }, this.says, this.reachSlider.root,
      h('div', { class: 'row' }, this.applies, button('Discard', () => hooks.discard(), { id: 'co-discard' })));
    this.root = section('Colour a thing',
      h('p', { class: 'soft small' }, 'Draw on the photo, or click a thing in the scene. It gets this colour in all photos.'),
      h('div', { class: 'row' }, h('label', { for: 'co-color', class: 'said' }, 'Colour'), this.input, this.here, this.neutral),
      this.swatches, h('div', { class: 'row' }, this.picker), width.root, this.draft);
    this.take({ color: this.color });
  }

  // By keyboard the slider is released at every step.
  private release(reach: number): void {
    clearTimeout(this.releasing);
    this.releasing = setTimeout(() => this.hooks.reached(reach), settled);
  }
  get fill(): Fill {
    return this.isNeutral ? { keep: 'neutral' } : { color: this.color };
  }
  get shownColor(): string {
    return this.isNeutral ? '#8a8f94' : this.color;
  }
  take({ color, keep }: Fill): void {
    this.isNeutral = keep === 'neutral';
    if (color) {
      this.color = color;
      this.input.value = color;
    }
    this.neutral.setAttribute('aria-pressed', String(this.isNeutral));
    this.showHere(60);
    this.hooks.changed();
  }
  setTool(tool: Tool): void {
    this.tool = tool;
    this.picker.setAttribute('aria-pressed', String(tool === 'pick'));
    this.hooks.changed();
  }
  // The colour as it looks at a luminance of the photo.
  showHere(luminance: number): void {
    this.here.style.backgroundColor = this.isNeutral ? hexAtLuminance('#808080', luminance) : hexAtLuminance(this.color, luminance);
  }
  remember(): void {
    if (this.isNeutral) return;
    this.recent = [this.color, ...this.recent.filter((one) => one !== this.color)].slice(0, maxRecent);
    replace(this.swatches, ...this.recent.map((one) => {
      const swatch = h('button', { type: 'button', class: 'co-swatch', 'aria-label': `Colour ${one}`, title: one, onclick: () => this.take({ color: one }) });
      swatch.style.backgroundColor = one;
      return swatch;
    }));
  }
  // `text`: what the stroke does; null: there is no stroke.
  showDraft(text: string | null, reach: number, canApply: boolean): void {
    this.draft.hidden = text === null;
    if (text !== null && this.says.textContent !== text) this.says.textContent = text;
    if (document.activeElement !== this.reachSlider.input) this.reachSlider.set(sliderOfReach(reach));
    this.applies.disabled = !canApply;
  }
}
