// What the user has set, with notices of changes.
import type { Fill } from '../model/stroke_file';

export type Tool = 'brush' | 'line' | 'region' | 'eraser' | 'picker';
export const tools: readonly Tool[] = ['brush', 'line', 'region', 'eraser', 'picker'];
export type PickSource = 'seen' | 'photo' | 'automatic';
export type Layer = 'strokes' | 'preview' | 'automatic';
export interface LayerState {
  readonly isShown: boolean;
  readonly opacity: number; // 0..1
}

export interface Settings {
  readonly tool: Tool;
  readonly width: number; // of brush, line and eraser, px of the photo
  readonly withPressure: boolean;
  readonly reach: number; // of the region tool, 1..100
  readonly fill: Fill;
  readonly recent: readonly string[]; // "#rrggbb", newest first
  readonly pickFrom: PickSource;
  readonly layers: Readonly<Record<Layer, LayerState>>;
  readonly isSolid: boolean; // strokes as flat colour, not as a tint
  readonly isComparing: boolean; // the photo alone
  readonly hasPhotoColors: boolean; // show the photo's own colours
  readonly luminance: number; // L of the photo under the pointer
}

export const recentLimit = 12;

// Size of a photo's brush at first: of its longer side.
const firstWidth = 1 / 60;
export const firstSettings = (longerSide: number): Settings => ({
  tool: 'brush',
  width: Math.max(2, Math.round(longerSide * firstWidth)),
  withPressure: true,
  reach: 38,
  fill: { color: '#b5654a' },
  recent: [],
  pickFrom: 'seen',
  layers: {
    strokes: { isShown: true, opacity: 1 },
    preview: { isShown: true, opacity: 1 },
    automatic: { isShown: true, opacity: 1 },
  },
  isSolid: false,
  isComparing: false,
  hasPhotoColors: false,
  luminance: 60,
});

export class SettingsStore {
  private listeners: ((now: Settings, before: Settings) => void)[] = [];

  constructor(private current: Settings) {}

  get now(): Settings {
    return this.current;
  }
  set(changes: Partial<Settings>): void {
    const before = this.current;
    this.current = { ...before, ...changes };
    for (const listener of this.listeners) listener(this.current, before);
  }
  setLayer(layer: Layer, changes: Partial<LayerState>): void {
    this.set({ layers: { ...this.current.layers, [layer]: { ...this.current.layers[layer], ...changes } } });
  }
  onChange(listener: (now: Settings, before: Settings) => void): void {
    this.listeners.push(listener);
  }
}

// The widths of the slider: even steps are equal shares.
export const largestWidth = (longerSide: number): number => Math.max(64, Math.round(longerSide / 4));
export const sliderOfWidth = (width: number, largest: number): number =>
  Math.round((100 * Math.log(Math.max(width, 1))) / Math.log(largest));
export const widthOfSlider = (value: number, largest: number): number => {
  const width = Math.exp((value / 100) * Math.log(largest));
  return width < 10 ? Math.round(width * 2) / 2 : Math.round(width);
};
// The resistance that the region tool overcomes at a reach of 1..100.
export const resistanceOfReach = (reach: number): number => 0.2 * 500 ** (reach / 100);
