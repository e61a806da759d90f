// Elements of the page. No other module writes HTML.

type Child = Node | string | null | undefined | false;
type Properties = Record<string, string | number | boolean | EventListener | undefined>;

// Attributes by name; onclick and the like take a listener; `disabled: false` leaves it out.
export const h = <Tag extends keyof HTMLElementTagNameMap>(
  tag: Tag, properties: Properties = {}, ...children: Child[]
): HTMLElementTagNameMap[Tag] => {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (typeof value === 'function') element.addEventListener(name.replace(/^on/, ''), value);
    else if (value !== undefined && value !== false) element.setAttribute(name, value === true ? '' : String(value));
  }
  element.append(...children.filter((child): child is Node | string => child !== null && child !== undefined && child !== false));
  return element;
};

export const replace = (parent: Element, ...children: Child[]): void => {
  parent.replaceChildren(...children.filter((child): child is Node | string => child !== null && child !== undefined && child !== false));
};

// Tells those who do not see the page.
export const say = (text: string): void => {
  const said = document.getElementById('said');
  if (said && said.textContent !== text) said.textContent = text;
};

export const problem = (text: string, ...more: Child[]): HTMLElement =>
  h('div', { class: 'problem', role: 'alert' }, h('p', {}, text), ...more);

export const button = (
  text: string, press: () => void, properties: Properties = {},
): HTMLButtonElement => h('button', { type: 'button', onclick: () => press(), ...properties }, text);

// A bar without text; `label` names it.
export const bar = (label: string): { element: HTMLElement; set: (share: number | null) => void } => {
  const progress = h('progress', { max: 1, 'aria-label': label });
  return {
    element: progress,
    set: (share) => {
      if (share === null) progress.removeAttribute('value');
      else progress.value = share;
    },
  };
};
