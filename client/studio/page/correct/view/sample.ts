// Parts of a picture around a place: their mean, and the place as a small picture.
import type { SceneView } from '../calls';
import { boxOf, type Stroke } from '../model/strokes';
import { pixelsOf, type Crop, type Parts } from './shading';

const samples = 5;
const leastSide = 64; // px of the picture

export interface Sample { readonly gray: number; readonly color: readonly [number, number] } // bytes

// Mean around (x, y), px of the picture. null: there are no colours.
export const sampleAt = (parts: Parts, view: SceneView, x: number, y: number, side: number): Sample | null => {
  if (!parts.color) return null;
  const crop = { x: (x - side / 2) / view.width, y: (y - side / 2) / view.height, width: side / view.width, height: side / view.height };
  const mean = (bitmap: ImageBitmap, channel: number): number => {
    const pixels = pixelsOf(bitmap, samples, samples, crop);
    let sum = 0;
    for (let i = channel; i < pixels.length; i += 4) sum += pixels[i]!;
    return sum / (samples * samples);
  };
  return { gray: Math.round(mean(parts.photo, 0)), color: [mean(parts.color, 0), mean(parts.color, 1)] };
};

// The surroundings of strokes that are in px of the photo as captured.
export const cropOf = (strokes: readonly Stroke[], view: SceneView): Crop => {
  const scale = view.width / view.photo_width;
  const box = boxOf(strokes.map((stroke): Stroke => ('line' in stroke
    ? { ...stroke, line: stroke.line.map(([x, y]) => [scale * x, scale * y]), width: scale * stroke.width }
    : { ...stroke, x: scale * stroke.x, y: scale * stroke.y, radius: scale * stroke.radius })), view, leastSide);
  return { x: box.x / view.width, y: box.y / view.height, width: box.side / view.width, height: box.side / view.height };
};
