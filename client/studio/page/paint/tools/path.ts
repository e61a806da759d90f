// From the way of a pointer to entries of the format: cut at the photo's borders, without superfluous points, one
// line for each width.
import type { Fill, Line, Point, StrokeEntry } from '../model/stroke_file';
import { simplified } from '../raster/contour';
import type { Size } from '../raster/mask';

// A place of the pointer, px of the photo. pressure: 0..1.
export interface Sample {
  readonly x: number;
  readonly y: number;
  readonly pressure: number;
}

// Widths of one stroke differ by at least this share of the brush, so that a stroke has few entries.
const widthStep = 1 / 8;
const thinnest = 0.25; // share of the width at no pressure

const rounded = (value: number): number => Math.round(value * 10) / 10;

// The part of a segment inside the photo, as shares of its length; undefined: none.
export const insideShares = (p: Point, q: Point, size: Size): [number, number] | undefined => {
  let low = 0, high = 1;
  const d = [q[0] - p[0], q[1] - p[1]];
  for (const [axis, side] of [[0, size.width], [1, size.height]] as const) {
    if (d[axis] === 0) {
      if (p[axis] < 0 || p[axis] > side) return undefined;
      continue;
    }
    const at = [(0 - p[axis]) / d[axis], (side - p[axis]) / d[axis]].sort((x, y) => x - y);
    low = Math.max(low, at[0]);
    high = Math.min(high, at[1]);
  }
  return low <= high ? [low, high] : undefined;
};

const between = (p: Sample, q: Sample, t: number): Sample => ({
  x: p.x + t * (q.x - p.x),
  y: p.y + t * (q.y - p.y),
  pressure: p.pressure + t * (q.pressure - p.pressure),
});

// The runs of the way inside the photo.
export const runsInside = (samples: readonly Sample[], size: Size): Sample[][] => {
  if (samples.length === 1) {
    const { x, y } = samples[0];
    return x >= 0 && y >= 0 && x < size.width && y < size.height ? [[samples[0]]] : [];
  }
  const runs: Sample[][] = [];
  let joins = false;
  for (let i = 0; i + 1 < samples.length; ++i) {
    const p = samples[i], q = samples[i + 1];
    const shares = insideShares([p.x, p.y], [q.x, q.y], size);
    if (!shares) {
      joins = false;
      continue;
    }
    if (!joins || shares[0] > 0) runs.push([between(p, q, shares[0])]);
    runs.at(-1)!.push(between(p, q, shares[1]));
    joins = shares[1] === 1;
  }
  return runs;
};

// Requires: 0 <= pressure <= 1.
export const widthAt = (size: number, pressure: number): number => {
  const share = thinnest + (1 - thinnest) * pressure;
  return size * Math.max(thinnest, Math.round(share / widthStep) * widthStep);
};

interface Stretch {
  readonly width: number;
  readonly samples: Sample[];
}
// Parts of equal width; each begins where the one before ends.
const stretches = (run: readonly Sample[], width: number, withPressure: boolean): Stretch[] => {
  if (!withPressure) return [{ width, samples: [...run] }];
  const parts: Stretch[] = [];
  for (let i = 0; i < run.length; ++i) {
    const wanted = widthAt(width, run[i].pressure);
    const last = parts.at(-1);
    if (last && Math.abs(last.width - wanted) < width * widthStep * 0.99) last.samples.push(run[i]);
    else parts.push({ width: wanted, samples: last ? [run[i - 1], run[i]] : [run[i]] });
  }
  return parts;
};

export interface Brush {
  readonly width: number; // px of the photo
  readonly withPressure: boolean;
  readonly fill: Fill;
  readonly tolerance: number; // px that the way may be off
}

// The entries of a stroke: a disc where the pointer did not move.
export const entriesOfPath = (samples: readonly Sample[], brush: Brush, size: Size): StrokeEntry[] =>
  runsInside(samples, size).flatMap((run) =>
    stretches(run, brush.width, brush.withPressure).map(({ width, samples: part }): StrokeEntry => {
      const points = part.map(({ x, y }): Point => [rounded(x), rounded(y)]);
      const line = simplified(points, brush.tolerance).filter((p, i, all) => {
        const q = all[i - 1];
        return !q || p[0] !== q[0] || p[1] !== q[1];
      });
      if (line.length > 1) return { line, width: rounded(width), ...brush.fill };
      const [x, y] = line[0];
      return {
        x: Math.min(x, Math.max(0, size.width - 0.1)),
        y: Math.min(y, Math.max(0, size.height - 0.1)),
        radius: rounded(width / 2),
        ...brush.fill,
      };
    }));

// The lines that an eraser of this width covers; it may pass outside of the photo.
export const linesOfEraser = (samples: readonly Sample[], width: number, size: Size): Line[] =>
  runsInside(samples, size).map((run) => ({ line: run.map(({ x, y }): Point => [x, y]), width }));

// The end of a line at a multiple of 15 degrees from its beginning.
export const snapped = (from: Sample, to: Sample): Sample => {
  const step = Math.PI / 12;
  const angle = Math.round(Math.atan2(to.y - from.y, to.x - from.x) / step) * step;
  const length = Math.hypot(to.x - from.x, to.y - from.y);
  return { ...to, x: from.x + length * Math.cos(angle), y: from.y + length * Math.sin(angle) };
};
