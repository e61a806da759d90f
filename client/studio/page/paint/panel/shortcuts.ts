// Keys, and the list of them. They count while the focus is in the painter and not in a field.
import type { Texts } from '../texts';
import { button, element } from './dom';
import { toolKeys } from './tool_panel';

export interface KeyPress {
  readonly key: string;
  readonly ctrlKey: boolean;
  readonly metaKey: boolean;
  readonly shiftKey: boolean;
  readonly altKey: boolean;
}
export type KeyCommand =
  | 'brush' | 'line' | 'region' | 'eraser' | 'picker' | 'undo' | 'redo' | 'zoomIn' | 'zoomOut' | 'fit' | 'fullSize'
  | 'smaller' | 'larger' | 'swap' | 'compare' | 'shortcuts' | 'save' | 'open';

const plain: Readonly<Record<string, KeyCommand>> = {
  b: 'brush', l: 'line', r: 'region', e: 'eraser', i: 'picker', '+': 'zoomIn', '=': 'zoomIn', '-': 'zoomOut',
  '0': 'fit', '1': 'fullSize', '[': 'smaller', ']': 'larger', ',': 'smaller', '.': 'larger', x: 'swap', c: 'compare',
  '?': 'shortcuts',
};
const withControl: Readonly<Record<string, KeyCommand>> = { y: 'redo', s: 'save', o: 'open' };

export const commandOfKey = (press: KeyPress): KeyCommand | undefined => {
  const key = press.key.toLowerCase();
  if (press.altKey) return undefined;
  if (press.ctrlKey || press.metaKey) {
    if (key === 'z') return press.shiftKey ? 'redo' : 'undo';
    return Object.hasOwn(withControl, key) ? withControl[key] : undefined;
  }
  return Object.hasOwn(plain, key) ? plain[key] : undefined;
};

// Whether keys belong to the element: a field to type in, or a slider or list for its arrows.
export const takesKeys = (tag: string, type: string): boolean =>
  tag === 'TEXTAREA' || tag === 'SELECT' || (tag === 'INPUT' && !['range', 'checkbox', 'file'].includes(type));

export const shortcutDialog = (texts: Texts): HTMLDialogElement => {
  const rows: [string, string][] = [
    ...(['brush', 'line', 'region', 'eraser', 'picker'] as const).map((tool): [string, string] =>
      [toolKeys[tool], texts[tool]]),
    [', .', `${texts.smaller}, ${texts.larger}`],
    ['X', texts.swap],
    ['Ctrl+Z', texts.undo],
    ['Ctrl+Shift+Z, Ctrl+Y', texts.redo],
    [texts.panKeys, texts.pan],
    [texts.zoomKeys, `${texts.zoomIn}, ${texts.zoomOut}`],
    ['0', texts.fit],
    ['1', texts.fullSize],
    ['C', texts.compare],
    [texts.pickTemporarilyKeys, texts.pickTemporarily],
    [texts.keyboardPaintKeys, texts.keyboardPaint],
    ['Ctrl+S', texts.save],
    ['Ctrl+O', texts.open],
    ['?', texts.shortcuts],
  ];
  const dialog = element('dialog', { class: 'paint-dialog', 'aria-label': texts.shortcuts });
  dialog.append(
    element('header', {}, element('h2', {}, texts.shortcuts),
      button({ label: texts.close, icon: 'M6 6l12 12M18 6 6 18' }, () => dialog.close())),
    element('dl', {}, ...rows.map(([keys, what]) =>
      element('div', {}, element('dt', {}, what), element('dd', {}, keys)))));
  dialog.addEventListener('click', (event) => {
    if (event.target === dialog) dialog.close();
  });
  return dialog;
};
