// Controls that several panels have.
import { h } from '../../dom';

export interface Slider { readonly root: HTMLElement; readonly input: HTMLInputElement; set(value: number): void }

// `input` while the handle moves, `release` when it is let go of. `text`: the value as it is shown and read out.
export const slider = (
  options: { id: string; label: string; min: number; max: number; step: number; value: number; text: (value: number) => string },
  hooks: { input: (value: number) => void; release?: (value: number) => void },
): Slider => {
  const { id, label, min, max, step, text } = options;
  const value = h('output', { for: id });
  const input = h('input', { type: 'range', id, min, max, step });
  const show = (): void => {
    value.textContent = text(Number(input.value));
    input.setAttribute('aria-valuetext', text(Number(input.value)));
  };
  input.addEventListener('input', () => {
    show();
    hooks.input(Number(input.value));
  });
  input.addEventListener('change', () => hooks.release?.(Number(input.value)));
  const set = (next: number): void => {
    input.value = String(next);
    show();
  };
  set(options.value);
  return { root: h('div', { class: 'co-slider' }, h('label', { for: id }, label), value, input), input, set };
};

// Buttons of which one is pressed.
export const oneOf = <Name extends string>(
  label: string, choices: readonly (readonly [Name, string])[], choose: (name: Name) => void,
): { root: HTMLElement; set: (name: Name) => void; enable: (name: Name, on: boolean) => void } => {
  const buttons = new Map(choices.map(([name, text]) =>
    [name, h('button', { type: 'button', 'data-name': name, 'aria-pressed': 'false', onclick: () => choose(name) }, text)]));
  return {
    root: h('div', { class: 'co-group', role: 'group', 'aria-label': label }, ...buttons.values()),
    set: (name) => {
      for (const [own, button] of buttons) button.setAttribute('aria-pressed', String(own === name));
    },
    enable: (name, on) => {
      buttons.get(name)!.disabled = !on;
    },
  };
};

export const section = (title: string, ...children: (Node | false)[]): HTMLElement => {
  const id = `co-${title.toLowerCase().replaceAll(/[^a-z]+/g, '-')}`;
  return h('section', { class: 'co-section', 'aria-labelledby': id }, h('h3', { id }, title), ...children);
};
