// Where the photo lies on the canvas: screen = scale * photo + (x, y), in CSS px of the canvas.
import type { Size } from '../raster/mask';

export interface View {
  readonly scale: number;
  readonly x: number;
  readonly y: number;
}

const margin = 12; // px around a photo that fits
export const maxScale = 32;

export const toPhoto = (view: View, x: number, y: number): [number, number] =>
  [(x - view.x) / view.scale, (y - view.y) / view.scale];
export const toScreen = (view: View, x: number, y: number): [number, number] =>
  [view.scale * x + view.x, view.scale * y + view.y];

export const fitted = (photo: Size, canvas: Size): View => {
  const room = (side: number) => Math.max(side - 2 * margin, 16);
  const scale = Math.min(room(canvas.width) / photo.width, room(canvas.height) / photo.height, maxScale);
  return { scale, x: (canvas.width - scale * photo.width) / 2, y: (canvas.height - scale * photo.height) / 2 };
};

// At least a quarter of the canvas, or all of a smaller photo, stays in sight.
const kept = (offset: number, length: number, side: number): number => {
  const least = Math.min(side / 4, length);
  return Math.min(side - least, Math.max(least - length, offset));
};
export const clamped = (view: View, photo: Size, canvas: Size): View => ({
  scale: view.scale,
  x: kept(view.x, view.scale * photo.width, canvas.width),
  y: kept(view.y, view.scale * photo.height, canvas.height),
});

export const panned = (view: View, dx: number, dy: number, photo: Size, canvas: Size): View =>
  clamped({ scale: view.scale, x: view.x + dx, y: view.y + dy }, photo, canvas);

// What is under (x, y) stays there. A photo gets no smaller than half of what fits.
export const zoomed = (view: View, factor: number, x: number, y: number, photo: Size, canvas: Size): View => {
  const least = Math.min(fitted(photo, canvas).scale / 2, 1);
  const scale = Math.min(maxScale, Math.max(least, view.scale * factor));
  const [px, py] = toPhoto(view, x, y);
  return clamped({ scale, x: x - scale * px, y: y - scale * py }, photo, canvas);
};
