// Saturation and white balance of the whole scene: at once in the pictures, in the model when let go of.
import { button, h } from '../../dom';
import { plainTone, type Tone } from '../model/tone';
import { section, slider, type Slider } from './controls';

export interface ToneHooks {
  input(tone: Tone): void;
  release(tone: Tone): void;
  askGray(on: boolean): void;
}

const signed = (value: number, less: string, more: string): string =>
  Math.abs(value) < 0.5 ? 'as it is' : `${Math.abs(Math.round(value))} to ${value < 0 ? less : more}`;

export class TonePanel {
  readonly root: HTMLElement;
  private tone: Tone = plainTone;
  private readonly sliders: Record<keyof Tone, Slider>;
  private readonly gray = button('Click something grey', () => this.ask(this.gray.getAttribute('aria-pressed') !== 'true'),
    { 'aria-pressed': 'false', id: 'co-gray' });

  constructor(private readonly hooks: ToneHooks) {
    const make = (name: keyof Tone, label: string, min: number, max: number, step: number, text: (value: number) => string): Slider =>
      slider({ id: `co-${name}`, label, min, max, step, value: plainTone[name], text }, {
        input: (value) => { this.tone = { ...this.tone, [name]: value }; hooks.input(this.tone); },
        release: () => hooks.release(this.tone),
      });
    this.sliders = {
      saturation: make('saturation', 'Saturation', 0, 2, 0.01, (value) => `${Math.round(100 * value)} %`),
      warmth: make('warmth', 'Warmth', -50, 50, 0.5, (value) => signed(value, 'blue', 'yellow')),
      tint: make('tint', 'Tint', -50, 50, 0.5, (value) => signed(value, 'green', 'red')),
    };
    this.root = section('The whole scene', this.sliders.saturation.root, this.sliders.warmth.root, this.sliders.tint.root,
      h('div', { class: 'row' }, this.gray, button('Reset', () => { this.set(plainTone); hooks.input(plainTone); hooks.release(plainTone); }, { id: 'co-reset-tone' })));
  }

  set(tone: Tone): void {
    this.tone = tone;
    for (const name of Object.keys(this.sliders) as (keyof Tone)[]) this.sliders[name].set(tone[name]);
  }
  ask(on: boolean): void {
    this.gray.setAttribute('aria-pressed', String(on));
    this.hooks.askGray(on);
  }
  get isInUse(): boolean {
    return Object.values(this.sliders).some(({ input }) => input === document.activeElement);
  }
}
