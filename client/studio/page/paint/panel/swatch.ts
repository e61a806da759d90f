import { filled, type Texts } from '../texts';
import { element } from './dom';

// A button that shows a colour. `name`: what the colour is usual for.
export const swatch = (
  color: string, name: string | undefined, texts: Texts, isCurrent: boolean, onClick: () => void,
): HTMLButtonElement => {
  const label = name ? `${name}, ${color}` : filled('{}', color);
  const made = element('button', {
    type: 'button', class: 'paint-swatch', title: label, 'aria-label': `${texts.color} ${label}`,
    'aria-pressed': String(isCurrent), 'data-color': color,
  });
  made.style.background = color;
  made.addEventListener('click', onClick);
  return made;
};
