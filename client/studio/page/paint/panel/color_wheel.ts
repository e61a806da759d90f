// A plane of hue and chroma at one luminance: colours that sRGB does not have there are left out. For pointers; the
// sliders beside it do the same by keys.
import { isInGamut, srgbFromLabUnclamped, type Lab } from '../color/lab';
import { element } from './dom';

const side = 112; // px of the picture, drawn larger
const reach = 110; // Lab units from the middle to the rim

export interface ColorWheel {
  readonly root: HTMLElement;
  show(color: Lab, luminance: number): void;
}

export const colorWheel = (onPick: (a: number, b: number) => void): ColorWheel => {
  const canvas = element('canvas', { width: side, height: side });
  const mark = element('i');
  const root = element('div', { class: 'paint-wheel', 'aria-hidden': 'true' }, canvas, mark);
  const context = canvas.getContext('2d')!;
  let drawnAt = -1;

  const draw = (luminance: number) => {
    const picture = context.createImageData(side, side);
    for (let y = 0; y < side; ++y) {
      for (let x = 0; x < side; ++x) {
        const a = ((x + 0.5) / side - 0.5) * 2 * reach, b = -((y + 0.5) / side - 0.5) * 2 * reach;
        const radius = Math.hypot(a, b);
        if (radius > reach) continue;
        const rgb = srgbFromLabUnclamped({ l: luminance, a, b });
        const i = 4 * (y * side + x);
        picture.data[i] = 255 * rgb.r;
        picture.data[i + 1] = 255 * rgb.g;
        picture.data[i + 2] = 255 * rgb.b;
        picture.data[i + 3] = isInGamut(rgb, 0.004) ? 255 : 0;
      }
    }
    context.putImageData(picture, 0, 0);
  };
  const pick = (event: PointerEvent) => {
    const box = root.getBoundingClientRect();
    let a = ((event.clientX - box.left) / box.width - 0.5) * 2 * reach;
    let b = -((event.clientY - box.top) / box.height - 0.5) * 2 * reach;
    const radius = Math.hypot(a, b);
    if (radius > reach) [a, b] = [(a / radius) * reach, (b / radius) * reach];
    if (radius < 4) a = b = 0; // grey is easily met
    onPick(a, b);
  };
  root.addEventListener('pointerdown', (event) => {
    root.setPointerCapture(event.pointerId);
    pick(event);
  });
  root.addEventListener('pointermove', (event) => {
    if (event.buttons) pick(event);
  });
  return {
    root,
    show: (color, luminance) => {
      const l = Math.round(luminance);
      if (l !== drawnAt) draw((drawnAt = l));
      mark.style.left = `${50 + (50 * color.a) / reach}%`;
      mark.style.top = `${50 - (50 * color.b) / reach}%`;
    },
  };
};
