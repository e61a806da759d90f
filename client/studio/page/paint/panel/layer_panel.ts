// Which pictures are seen, and how strongly.
import { filled, type Texts } from '../texts';
import type { Layer, Settings, SettingsStore } from '../tools/settings';
import { element, section, slider } from './dom';

export interface LayerPanel {
  readonly root: HTMLElement;
  setAvailable(layer: Layer, isAvailable: boolean): void;
}

export const layerPanel = (store: SettingsStore, photoHasColor: boolean, texts: Texts): LayerPanel => {
  const names: readonly (readonly [Layer, string])[] = [
    ['strokes', texts.layerStrokes], ['preview', texts.layerPreview], ['automatic', texts.layerAutomatic]];
  const check = (label: string, isOn: boolean, onChange: (isOn: boolean) => void) => {
    const box = element('input', { type: 'checkbox' });
    box.checked = isOn;
    box.addEventListener('change', () => onChange(box.checked));
    return { box, row: element('label', { class: 'paint-check' }, box, element('span', {}, label)) };
  };
  const rows = new Map(names.map(([layer, name]) => {
    const { box, row } = check(name, true, (isShown) => store.setLayer(layer, { isShown }));
    box.setAttribute('aria-label', filled(texts.shown, name));
    store.onChange((now) => (box.checked = now.layers[layer].isShown));
    const opacity = slider(
      { label: name, min: 0, max: 100, value: 100 * store.now.layers[layer].opacity, text: (v) => `${v} %` },
      (v) => store.setLayer(layer, { opacity: v / 100 }));
    opacity.input.setAttribute('aria-label', filled(texts.opacity, name));
    opacity.root.firstElementChild!.remove(); // the check box has the name
    return [layer, element('div', { class: 'paint-layer', 'data-layer': layer }, row, opacity.root)] as const;
  }));
  const solid = check(texts.solid, store.now.isSolid, (isSolid) => store.set({ isSolid }));
  const own = check(texts.photoColors, store.now.hasPhotoColors, (hasPhotoColors) => store.set({ hasPhotoColors }));
  own.row.hidden = !photoHasColor;
  store.onChange((now: Settings, before) => {
    if (now.isSolid !== before.isSolid) solid.box.checked = now.isSolid;
  });
  return {
    root: section(texts.layers, true, ...rows.values(), solid.row, own.row),
    setAvailable: (layer, isAvailable) => {
      rows.get(layer)!.hidden = !isAvailable;
    },
  };
};
