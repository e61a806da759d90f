// The bar above the canvas: undo, zoom, compare, files.
import { filled, type Texts } from '../texts';
import { button, element } from './dom';
import { icons } from './icons';

export interface BarActions {
  undo(): void;
  redo(): void;
  zoom(factor: number): void;
  fit(): void;
  fullSize(): void;
  compare(): void;
  clear(): void;
  open(): void;
  save(): void;
  shortcuts(): void;
}
export interface BarState {
  readonly undoName: string | undefined;
  readonly redoName: string | undefined;
  readonly isComparing: boolean;
  readonly count: number;
  readonly scale: number; // of the photo's px to device px
}
export interface ActionBar {
  readonly root: HTMLElement;
  show(state: BarState): void;
}

export const actionBar = (actions: BarActions, texts: Texts): ActionBar => {
  const named = (label: string, key: string | undefined, shortcut: string | undefined, path: string, run: () => void,
    className?: string) =>
    button({ label, key, shortcut, icon: path, className }, run);
  const undo = named(texts.undo, 'Ctrl+Z', 'Control+Z', icons.undo, actions.undo);
  const redo = named(texts.redo, 'Ctrl+Y', 'Control+Y', icons.redo, actions.redo);
  const zoomOut = named(texts.zoomOut, '−', '-', icons.zoomOut, () => actions.zoom(1 / 1.25), 'paint-wide');
  const zoomIn = named(texts.zoomIn, '+', '+', icons.zoomIn, () => actions.zoom(1.25), 'paint-wide');
  const fit = named(texts.fit, '0', '0', icons.fit, actions.fit);
  const share = button({ label: texts.fullSize, key: '1', shortcut: '1', className: 'paint-zoom' }, actions.fullSize);
  const compare = button(
    { label: texts.compare, key: 'C', shortcut: 'C', icon: icons.compare, pressed: false }, actions.compare);
  const clear = named(texts.clear, undefined, undefined, icons.clear, actions.clear);
  const open = named(texts.open, 'Ctrl+O', 'Control+O', icons.open, actions.open);
  const save = named(texts.save, 'Ctrl+S', 'Control+S', icons.save, actions.save);
  const shortcuts = named(texts.shortcuts, '?', '?', icons.shortcuts, actions.shortcuts);
  const group = (...children: HTMLElement[]) => element('div', { class: 'paint-group' }, ...children);
  const describe = (made: HTMLButtonElement, label: string, key: string, name: string | undefined) => {
    made.setAttribute('aria-disabled', String(name === undefined)); // keeps the focus, unlike `disabled`
    made.title = name ? `${label}: ${name} (${key})` : `${label} (${key})`;
  };
  return {
    root: element('div', { class: 'paint-bar', role: 'toolbar', 'aria-label': texts.actions },
      group(undo, redo), group(zoomOut, share, zoomIn, fit), group(compare),
      group(clear, open, save), group(shortcuts)),
    show: (state) => {
      describe(undo, texts.undo, 'Ctrl+Z', state.undoName);
      describe(redo, texts.redo, 'Ctrl+Y', state.redoName);
      compare.setAttribute('aria-pressed', String(state.isComparing));
      for (const made of [clear, save]) made.setAttribute('aria-disabled', String(state.count === 0));
      const percent = Math.round(100 * state.scale);
      share.textContent = `${percent} %`;
      share.setAttribute('aria-label', `${percent} %, ${filled(texts.fullSize, '')}`);
    },
  };
};
