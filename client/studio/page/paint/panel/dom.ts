// Elements without a framework.
type Child = Node | string;
type Attributes = Record<string, string | number | boolean | undefined>;

export const element = <K extends keyof HTMLElementTagNameMap>(
  tag: K, attributes: Attributes = {}, ...children: Child[]
): HTMLElementTagNameMap[K] => {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === false) continue;
    made.setAttribute(name, value === true ? '' : String(value));
  }
  made.append(...children);
  return made;
};

const svgSpace = 'http://www.w3.org/2000/svg';
// A line drawing in a box of 24 x 24, from the data of a path.
export const icon = (path: string): SVGSVGElement => {
  const svg = document.createElementNS(svgSpace, 'svg');
  svg.setAttribute('viewBox', '0 0 24 24');
  svg.setAttribute('aria-hidden', 'true');
  const line = document.createElementNS(svgSpace, 'path');
  line.setAttribute('d', path);
  svg.append(line);
  return svg;
};

export interface ButtonOptions {
  readonly label: string;
  readonly icon?: string;
  readonly shortcut?: string; // as aria-keyshortcuts
  readonly key?: string; // as shown
  readonly showLabel?: boolean;
  readonly pressed?: boolean;
  readonly className?: string;
}
export const button = (options: ButtonOptions, onClick: () => void): HTMLButtonElement => {
  const { label, shortcut, key, pressed, className } = options;
  const made = element('button', {
    type: 'button',
    class: className,
    title: key ? `${label} (${key})` : label,
    'aria-label': options.showLabel ? undefined : label,
    'aria-keyshortcuts': shortcut,
    'aria-pressed': pressed === undefined ? undefined : String(pressed),
  });
  if (options.icon) made.append(icon(options.icon));
  if (options.showLabel) made.append(element('span', {}, label));
  made.addEventListener('click', onClick);
  return made;
};

export interface SliderOptions {
  readonly label: string;
  readonly min: number;
  readonly max: number;
  readonly step?: number;
  readonly value: number;
  readonly text: (value: number) => string; // as shown and spoken
}
export interface Slider {
  readonly root: HTMLElement;
  readonly input: HTMLInputElement;
  set(value: number): void;
}
export const slider = (options: SliderOptions, onInput: (value: number) => void): Slider => {
  const { min, max, step = 1 } = options;
  const input = element('input', { type: 'range', min, max, step });
  const output = element('output', {});
  const show = () => {
    const text = options.text(Number(input.value));
    output.textContent = text;
    input.setAttribute('aria-valuetext', text);
  };
  const set = (value: number) => {
    input.value = String(value);
    show();
  };
  input.addEventListener('input', () => {
    show();
    onInput(Number(input.value));
  });
  set(options.value);
  // The first control in a label is what it names.
  const root = element('label', { class: 'paint-slider' }, element('span', {}, options.label), input, output);
  return { root, input, set };
};

export const section = (title: string, isOpen: boolean, ...children: Child[]): HTMLDetailsElement => {
  const made = element('details', { class: 'paint-section' }, element('summary', {}, title), ...children);
  made.open = isOpen;
  return made;
};

// Lets the user choose a file; the same one may be chosen again.
export const fileButton = (
  options: ButtonOptions, accept: string, onFile: (file: File) => void,
): HTMLElement => {
  const input = element('input', { type: 'file', accept, hidden: true, tabindex: -1, 'aria-hidden': 'true' });
  input.addEventListener('change', () => {
    const file = input.files?.[0];
    if (file) onFile(file);
    input.value = '';
  });
  return element('span', { class: 'paint-file' }, button(options, () => input.click()), input);
};
