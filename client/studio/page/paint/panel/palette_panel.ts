// Palettes: usual colours of things, those of a reference picture, or a list.
import { colorsOfText, paletteOfPicture } from '../color/palette';
import { filled, type Texts } from '../texts';
import type { SettingsStore } from '../tools/settings';
import { canvasOf } from '../view/canvas';
import { button, element, fileButton, section } from './dom';
import { swatch } from './swatch';

interface NamedColor {
  readonly color: string;
  readonly name?: string;
}

const naturalColors: readonly (readonly [string, keyof Texts])[] = [
  ['#c99a80', 'skin'], ['#6b4a35', 'hair'], ['#b25e58', 'lips'], ['#5f7f3f', 'leaf'], ['#87a94f', 'grass'],
  ['#86b2d9', 'sky'], ['#4d8090', 'water'], ['#8f6238', 'wood'], ['#a4553a', 'brick'], ['#cdb184', 'sand'],
  ['#8d8a80', 'stone'], ['#4a648f', 'denim'],
];
const sampleSide = 256; // px of the reference picture that are looked at
const colorsOfPicture = 12;

const paletteOfFile = async (file: Blob): Promise<string[]> => {
  const bitmap = await createImageBitmap(file);
  const share = Math.min(1, sampleSide / Math.max(bitmap.width, bitmap.height));
  const [canvas, context] = canvasOf(bitmap.width * share, bitmap.height * share);
  context.drawImage(bitmap, 0, 0, canvas.width, canvas.height);
  bitmap.close();
  return paletteOfPicture(context.getImageData(0, 0, canvas.width, canvas.height).data, colorsOfPicture);
};

export const palettePanel = (store: SettingsStore, texts: Texts, say: (text: string) => void): HTMLElement => {
  const title = element('h3', {}, texts.palettes);
  const swatches = element('div', { class: 'paint-swatches paint-palette', role: 'group', 'aria-label': texts.palette });
  let colors: readonly NamedColor[] = naturalColors.map(([color, name]) => ({ color, name: texts[name] }));

  const show = () => swatches.replaceChildren(...colors.map(({ color, name }) =>
    swatch(color, name, texts, store.now.fill.color === color, () => store.set({ fill: { color } }))));
  const use = (name: string, list: readonly string[]) => {
    if (list.length === 0) {
      say(texts.noColors);
      return;
    }
    title.textContent = name;
    colors = list.map((color) => ({ color }));
    show();
  };

  const text = element('textarea', { rows: 2, spellcheck: 'false' });
  const list = element('div', { class: 'paint-list' },
    element('label', {}, element('span', {}, texts.paletteList), text),
    button({ label: texts.useList, showLabel: true }, () => {
      const { colors: read, rejected } = colorsOfText(text.value);
      if (rejected.length) say(filled(texts.notColors, rejected.slice(0, 5).join(', ')));
      if (read.length || !rejected.length) use(texts.palette, read);
      if (read.length && !rejected.length) setOpen(false);
    }));
  const opener = button({ label: texts.paletteFromList, showLabel: true }, () => setOpen(Boolean(list.hidden)));
  const setOpen = (isOpen: boolean) => {
    list.hidden = !isOpen;
    opener.setAttribute('aria-expanded', String(isOpen));
    if (isOpen) text.focus();
  };
  list.hidden = true;
  opener.setAttribute('aria-expanded', 'false');
  const fromPicture = fileButton({ label: texts.paletteFromPicture, showLabel: true }, 'image/*', (file) => {
    paletteOfFile(file).then(
      (read) => use(file.name, read),
      (error: Error) => say(filled(texts.notOpened, `${file.name}: ${error.message}`)));
  });

  store.onChange((now, before) => {
    if (now.fill !== before.fill) show();
  });
  show();
  return section(texts.palette, true, title, swatches,
    element('div', { class: 'paint-row' }, fromPicture, opener), list);
};
