// The row of tools, and what can be set for the one in use.
import type { Texts } from '../texts';
import {
  largestWidth, sliderOfWidth, tools, widthOfSlider, type PickSource, type Settings, type SettingsStore, type Tool,
} from '../tools/settings';
import { button, element, section, slider } from './dom';
import { icons } from './icons';

export const toolKeys: Record<Tool, string> = { brush: 'B', line: 'L', region: 'R', eraser: 'E', picker: 'I' };

export const toolRow = (store: SettingsStore, texts: Texts, onSettings: (isOpen: boolean) => void): HTMLElement => {
  const buttons = tools.map((tool) => {
    const made = button(
      { label: texts[tool], icon: icons[tool], key: toolKeys[tool], shortcut: toolKeys[tool], showLabel: true,
        pressed: false },
      () => store.set({ tool }));
    made.dataset.tool = tool;
    return made;
  });
  const opener = button(
    { label: texts.settings, icon: icons.settings, className: 'paint-opener' }, () => {
      const isOpen = opener.getAttribute('aria-expanded') !== 'true';
      opener.setAttribute('aria-expanded', String(isOpen));
      onSettings(isOpen);
    });
  opener.setAttribute('aria-expanded', 'true');
  const show = (now: Settings) => {
    for (const made of buttons) made.setAttribute('aria-pressed', String(made.dataset.tool === now.tool));
    opener.style.setProperty('--now', now.fill.color ?? '#8a8f94');
  };
  store.onChange(show);
  show(store.now);
  return element('div', { class: 'paint-tools', role: 'toolbar', 'aria-label': texts.tools }, ...buttons, opener);
};

export const toolPanel = (store: SettingsStore, longerSide: number, texts: Texts): HTMLElement => {
  const largest = largestWidth(longerSide);
  const width = slider(
    { label: texts.size, min: 0, max: 100, value: sliderOfWidth(store.now.width, largest),
      text: (v) => `${widthOfSlider(v, largest)} px` },
    (v) => store.set({ width: widthOfSlider(v, largest) }));
  const reach = slider({ label: texts.reach, min: 1, max: 100, value: store.now.reach, text: String },
    (v) => store.set({ reach: v }));
  const pressure = element('input', { type: 'checkbox' });
  pressure.checked = store.now.withPressure;
  pressure.addEventListener('change', () => store.set({ withPressure: pressure.checked }));
  const pressureRow = element('label', { class: 'paint-check' }, pressure, element('span', {}, texts.pressure));
  const source = element('select', {},
    ...([['seen', texts.pickSeen], ['photo', texts.pickPhoto], ['automatic', texts.pickAutomatic]] as const)
      .map(([value, label]) => element('option', { value }, label)));
  source.addEventListener('change', () => store.set({ pickFrom: source.value as PickSource }));
  const sourceRow = element('label', { class: 'paint-select' }, element('span', {}, texts.pickFrom), source);
  const hint = element('p', { class: 'paint-hint' });
  const root = section(texts.tool, true, width.root, pressureRow, reach.root, sourceRow, hint);
  const title = root.querySelector('summary')!;

  const show = (now: Settings) => {
    title.textContent = texts[now.tool];
    width.root.hidden = now.tool === 'region' || now.tool === 'picker';
    pressureRow.hidden = now.tool !== 'brush';
    reach.root.hidden = now.tool !== 'region';
    sourceRow.hidden = now.tool !== 'picker';
    hint.textContent = now.tool === 'region' ? texts.regionHint : now.tool === 'line' ? texts.lineHint : '';
    hint.hidden = !hint.textContent;
    width.set(sliderOfWidth(now.width, largest));
    reach.set(now.reach);
    source.value = now.pickFrom;
  };
  store.onChange((now, before) => {
    if (now.tool !== before.tool || now.width !== before.width || now.reach !== before.reach) show(now);
  });
  show(store.now);
  return root;
};
