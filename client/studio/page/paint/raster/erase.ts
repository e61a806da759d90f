// The eraser: takes from each entry the pixels that it passed over. The format has no entry that erases, so what is
// left of a touched entry becomes regions along the borders of its pixels.
import { isLabel, type Fill, type Line, type StrokeEntry, type StrokeFile } from '../model/stroke_file';
import { polygonsOfMask } from './contour';
import { boxesMeet, boxOf, isEmpty, maskOf, type Mask, type Size } from './mask';

// Clears in `from` what `by` has. Returns whether that changed it.
const subtract = (from: Mask, by: Mask): boolean => {
  let changed = false;
  const left = Math.max(from.x, by.x), right = Math.min(from.x + from.width, by.x + by.width);
  const top = Math.max(from.y, by.y), bottom = Math.min(from.y + from.height, by.y + by.height);
  for (let y = top; y < bottom; ++y) {
    for (let x = left; x < right; ++x) {
      const i = (y - from.y) * from.width + x - from.x;
      if (!from.data[i] || !by.data[(y - by.y) * by.width + x - by.x]) continue;
      from.data[i] = 0;
      changed = true;
    }
  }
  return changed;
};

// Returns the strokes without what the lines of the eraser cover; untouched entries are the same objects.
export const erased = (strokes: StrokeFile, eraser: readonly Line[], size: Size): StrokeEntry[] => {
  const erasers = eraser.map((line) => ({ box: boxOf(line), mask: maskOf(line, size) }));
  return strokes.flatMap((entry): StrokeEntry[] => {
    if (isLabel(entry)) return [entry];
    const touching = erasers.filter(({ box }) => boxesMeet(box, boxOf(entry)));
    if (touching.length === 0) return [entry];
    const mask = maskOf(entry, size);
    if (!touching.map(({ mask: by }) => subtract(mask, by)).includes(true)) return [entry];
    if (isEmpty(mask)) return [];
    const fill: Fill = entry.keep !== undefined ? { keep: entry.keep } : { color: entry.color };
    return polygonsOfMask(mask, 0).map((region) => ({ region, ...fill }));
  });
};
