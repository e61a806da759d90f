// Entries on a 2D canvas whose transform is that of the photo.
import { labFromHex, hexFromLab } from '../color/lab';
import {
  defaultRadius, halfWidth, isDisc, isLabel, isLine, isRegion, type Line, type StrokeEntry,
} from '../model/stroke_file';
import { loopsOfPolygon } from '../raster/contour';
import { boxesMeet, boxOf, type Box } from '../raster/mask';

export interface Paints {
  // L of the photo under an entry: tints are shown with it. undefined: colours as they are.
  readonly luminanceUnder?: (entry: StrokeEntry) => number;
  // For entries that keep the automatic colours.
  readonly automatic: CanvasPattern | string;
}

const paths = new WeakMap<StrokeEntry, Path2D>();
const boxes = new WeakMap<StrokeEntry, Box>();
const tints = new WeakMap<StrokeEntry, string>();

const cached = <K extends object, V>(map: WeakMap<K, V>, key: K, make: () => V): V => {
  let value = map.get(key);
  if (value === undefined) map.set(key, (value = make()));
  return value;
};

const styleOf = (entry: StrokeEntry, { automatic, luminanceUnder }: Paints): CanvasPattern | string => {
  if (entry.keep !== undefined) return entry.keep === 'auto' ? automatic : '#808080';
  const { color } = entry;
  return luminanceUnder
    ? cached(tints, entry, () => hexFromLab({ ...labFromHex(color), l: luminanceUnder(entry) })) : color;
};

export const pathOfLine = ({ line }: Line): Path2D => {
  const path = new Path2D();
  path.moveTo(...line[0]);
  for (const point of line.slice(line.length > 1 ? 1 : 0)) path.lineTo(...point);
  return path;
};
const pathOfRegion = (entry: StrokeEntry): Path2D => {
  const path = new Path2D();
  if (!isRegion(entry)) return path;
  for (const loop of loopsOfPolygon(entry.region)) {
    path.moveTo(...loop[0]);
    for (const point of loop.slice(1)) path.lineTo(...point);
    path.closePath();
  }
  return path;
};

export const strokeLine = (context: CanvasRenderingContext2D, path: Path2D, width: number): void => {
  context.lineWidth = Math.max(width, 1);
  context.lineCap = context.lineJoin = 'round';
  context.stroke(path);
};

// Draws what lies within `seen`, px of the photo.
export const drawEntries = (
  context: CanvasRenderingContext2D, entries: readonly StrokeEntry[], seen: Box, paints: Paints,
): void => {
  for (const entry of entries) {
    if (isLabel(entry) || !boxesMeet(cached(boxes, entry, () => boxOf(entry)), seen)) continue;
    const style = styleOf(entry, paints);
    context.fillStyle = context.strokeStyle = style;
    if (isDisc(entry)) {
      context.beginPath();
      context.arc(entry.x, entry.y, Math.max(entry.radius ?? defaultRadius, 0.5), 0, 2 * Math.PI);
      context.fill();
    } else if (isLine(entry)) {
      strokeLine(context, cached(paths, entry, () => pathOfLine(entry)), 2 * halfWidth(entry));
    } else {
      context.fill(cached(paths, entry, () => pathOfRegion(entry)), 'evenodd');
    }
  }
};
