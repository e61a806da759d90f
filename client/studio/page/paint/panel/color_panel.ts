// The colour in use: wheel, sliders, code, what it looks like on the photo, colours used last.
import { chromaOf, hexAtLuminance, hexFromLab, hueOf, labFromHex } from '../color/lab';
import { colorsOfText } from '../color/palette';
import type { Fill } from '../model/stroke_file';
import type { Texts } from '../texts';
import type { Settings, SettingsStore } from '../tools/settings';
import { colorWheel } from './color_wheel';
import { button, element, section, slider } from './dom';
import { swatch } from './swatch';

// The wheel shows colours at the photo's luminance, but not so dark or bright that there is none to choose.
const wheelLuminance = (l: number): number => Math.min(78, Math.max(38, l));
const largestChroma = 110;

const equal = (x: Fill, y: Fill): boolean => x.color === y.color && x.keep === y.keep;

export const colorPanel = (store: SettingsStore, texts: Texts): HTMLElement => {
  let shownHex = '#808080';
  const choose = (hex: string) => store.set({ fill: { color: hex } });
  const chooseAb = (a: number, b: number) =>
    choose(hexFromLab({ l: wheelLuminance(store.now.luminance), a, b }));

  const wheel = colorWheel(chooseAb);
  const polar = (hue: number, chroma: number) => {
    const angle = (hue * Math.PI) / 180;
    chooseAb(chroma * Math.cos(angle), chroma * Math.sin(angle));
  };
  // The sliders keep what the user set: a grey has no hue, and the gamut ends where it ends.
  let isSliding = false;
  const slide = () => {
    isSliding = true;
    polar(Number(hue.input.value), Number(chroma.input.value));
    isSliding = false;
  };
  const hue = slider({ label: texts.hue, min: 0, max: 359, value: 40, text: (v) => `${v}°` }, slide);
  const chroma = slider({ label: texts.chroma, min: 0, max: largestChroma, value: 40, text: String }, slide);
  hue.root.classList.add('paint-hue');
  chroma.root.classList.add('paint-chroma');

  const code = element('input', { type: 'text', maxlength: 7, spellcheck: 'false', autocomplete: 'off' });
  code.addEventListener('change', () => {
    const [color] = colorsOfText(code.value).colors;
    if (color) choose(color);
    else code.value = shownHex;
  });
  const here = element('span', { class: 'paint-here', title: texts.colorHere });
  const own = element('span', { class: 'paint-own' });
  const current = element('div', { class: 'paint-current' },
    element('span', { class: 'paint-pair', role: 'img', 'aria-label': texts.colorHere }, own, here),
    element('label', { class: 'paint-code' }, element('span', {}, texts.hex), code));

  const neutral = button({ label: texts.neutral, showLabel: true, pressed: false, className: 'paint-keep' },
    () => store.set({ fill: { keep: 'neutral' } }));
  const automatic = button({ label: texts.automatic, showLabel: true, pressed: false, className: 'paint-keep' },
    () => store.set({ fill: { keep: 'auto' } }));
  const recent = element('div', { class: 'paint-swatches', role: 'group', 'aria-label': texts.recent });
  const recentBlock = element('div', { class: 'paint-recent' }, element('h3', {}, texts.recent), recent);

  const show = (now: Settings) => {
    const { fill, luminance } = now;
    if (fill.color !== undefined) {
      const lab = labFromHex(fill.color);
      shownHex = fill.color;
      wheel.show(lab, wheelLuminance(luminance));
      if (!isSliding) {
        if (chromaOf(lab) > 1) hue.set(Math.round(hueOf(lab)) % 360);
        chroma.set(Math.round(Math.min(largestChroma, chromaOf(lab))));
      }
      if (document.activeElement !== code) code.value = fill.color;
      own.style.background = fill.color;
      here.style.background = hexAtLuminance(fill.color, luminance);
    } else {
      wheel.show({ l: 0, a: 0, b: 0 }, wheelLuminance(luminance));
      own.style.background = here.style.background = fill.keep === 'neutral'
        ? hexFromLab({ l: luminance, a: 0, b: 0 })
        : 'repeating-linear-gradient(135deg,#8a8f94 0 4px,#c9ccd0 4px 8px)';
    }
    chroma.root.style.setProperty('--full', hexFromLab({
      l: wheelLuminance(luminance),
      a: 60 * Math.cos((Number(hue.input.value) * Math.PI) / 180),
      b: 60 * Math.sin((Number(hue.input.value) * Math.PI) / 180),
    }));
    neutral.setAttribute('aria-pressed', String(fill.keep === 'neutral'));
    automatic.setAttribute('aria-pressed', String(fill.keep === 'auto'));
  };
  const showRecent = (now: Settings) => {
    recentBlock.hidden = now.recent.length === 0;
    recent.replaceChildren(...now.recent.map((color) =>
      swatch(color, undefined, texts, equal(now.fill, { color }), () => choose(color))));
  };
  store.onChange((now, before) => {
    if (now.fill !== before.fill || now.luminance !== before.luminance) show(now);
    if (now.recent !== before.recent || now.fill !== before.fill) showRecent(now);
  });
  show(store.now);
  showRecent(store.now);
  return section(texts.color, true,
    element('div', { class: 'paint-mix' }, wheel.root,
      element('div', { class: 'paint-mixers' }, current, hue.root, chroma.root)),
    element('div', { class: 'paint-row' }, neutral, automatic), recentBlock);
};
