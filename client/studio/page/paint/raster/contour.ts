// Polygons of masks, and loops of polygons. Loops run along the borders of pixels, so that without
// simplification a polygon covers exactly the pixels of its mask.
import { maxPoints, type Point } from '../model/stroke_file';
import type { Mask } from './mask';

// Loops around the pixels that are set, outer ones and holes; pixels that touch by a corner only are apart.
export const loopsOfMask = (mask: Mask): Point[][] => {
  const { width: w, height: h, data } = mask;
  const at = (x: number, y: number): number => (x >= 0 && y >= 0 && x < w && y < h ? data[y * w + x] : 0);
  // Directions: 0 right, 1 down, 2 left, 3 up. Bit d of edges[v]: an edge leaves the corner v that way, with
  // the inside at its right hand.
  const edges = new Uint8Array((w + 1) * (h + 1));
  for (let y = 0; y < h; ++y) {
    for (let x = 0; x < w; ++x) {
      if (!data[y * w + x]) continue;
      const v = y * (w + 1) + x;
      if (!at(x, y - 1)) edges[v] |= 1;
      if (!at(x + 1, y)) edges[v + 1] |= 2;
      if (!at(x, y + 1)) edges[v + w + 2] |= 4;
      if (!at(x - 1, y)) edges[v + w + 1] |= 8;
    }
  }
  const steps = [1, w + 1, -1, -(w + 1)];
  const open = edges.slice();
  // Right first: at a corner where two pixels touch, the loop stays with its own.
  const after = (v: number, direction: number): number =>
    [(direction + 1) & 3, direction, (direction + 3) & 3].find((d) => edges[v] & (1 << d))!;
  const loops: Point[][] = [];
  for (let start = 0; start < edges.length; ++start) {
    while (open[start]) {
      const first = [0, 1, 2, 3].find((d) => open[start] & (1 << d))!;
      const loop: Point[] = [];
      let v = start, direction = first, before = -1;
      do {
        open[v] &= ~(1 << direction);
        if (direction !== before) loop.push([mask.x + (v % (w + 1)), mask.y + Math.floor(v / (w + 1))]);
        before = direction;
        v += steps[direction];
        direction = after(v, direction);
      } while (v !== start || direction !== first);
      loops.push(loop);
    }
  }
  return loops;
};

const distanceTo = ([x, y]: Point, p: Point, q: Point): number => {
  const dx = q[0] - p[0], dy = q[1] - p[1];
  const length = dx * dx + dy * dy;
  const t = length > 0 ? Math.min(1, Math.max(0, ((x - p[0]) * dx + (y - p[1]) * dy) / length)) : 0;
  return Math.hypot(x - p[0] - t * dx, y - p[1] - t * dy);
};

// Douglas and Peucker: the points without those that lie within `tolerance` of what remains.
export const simplified = (points: readonly Point[], tolerance: number): Point[] => {
  if (points.length < 3) return [...points];
  const keep = new Uint8Array(points.length);
  keep[0] = keep[points.length - 1] = 1;
  const open: [number, number][] = [[0, points.length - 1]];
  while (open.length) {
    const [first, last] = open.pop()!;
    let farthest = -1;
    let most = tolerance;
    for (let i = first + 1; i < last; ++i) {
      const d = distanceTo(points[i], points[first], points[last]);
      if (d > most) {
        most = d;
        farthest = i;
      }
    }
    if (farthest < 0) continue;
    keep[farthest] = 1;
    open.push([first, farthest], [farthest, last]);
  }
  return points.filter((_, i) => keep[i]);
};

const simplifiedLoop = (loop: readonly Point[], tolerance: number): Point[] => {
  if (tolerance <= 0) return [...loop];
  // Cut where two halves are longest, so that the loop does not depend on where it begins.
  let opposite = 0;
  const far = (i: number) => Math.hypot(loop[i][0] - loop[0][0], loop[i][1] - loop[0][1]);
  for (let i = 1; i < loop.length; ++i) if (far(i) > far(opposite)) opposite = i;
  const one = simplified(loop.slice(0, opposite + 1), tolerance);
  const other = simplified([...loop.slice(opposite), loop[0]], tolerance);
  return [...one.slice(0, -1), ...other.slice(0, -1)];
};

// Twice the signed area: positive for outer loops of loopsOfMask, negative for holes.
export const doubleArea = (loop: readonly Point[]): number =>
  loop.reduce((sum, [x, y], i) => {
    const [u, v] = loop[(i + 1) % loop.length];
    return sum + x * v - u * y;
  }, 0);

// One polygon (even-odd) of several loops: each hangs on the first by an edge walked to and fro.
export const joined = (loops: readonly (readonly Point[])[]): Point[] => {
  if (loops.length <= 1) return [...(loops[0] ?? [])];
  const anchor = loops[0][0];
  return [...loops[0], anchor, ...loops.slice(1).flatMap((loop) => [...loop, loop[0], anchor])].slice(0, -1);
};

// The loops of a polygon: undoes `joined`, and leaves other polygons as they cover.
export const loopsOfPolygon = (polygon: readonly Point[]): Point[][] => {
  const loops: Point[][] = [];
  const stack: Point[] = [];
  const seen = new Map<string, number>();
  const key = (p: Point) => p[0] + ' ' + p[1];
  for (const point of polygon) {
    const at = seen.get(key(point));
    if (at !== undefined) {
      const loop = stack.splice(at);
      for (const p of loop) seen.delete(key(p));
      if (loop.length > 2) loops.push(loop);
    }
    seen.set(key(point), stack.length);
    stack.push(point);
  }
  if (stack.length > 2) loops.push(stack);
  return loops;
};

const inside = (loop: readonly Point[], [x, y]: Point): boolean =>
  loop.reduce((odd, p, i) => {
    const q = loop[(i + 1) % loop.length];
    return p[1] <= y === q[1] <= y ? odd : odd !== p[0] + ((y - p[1]) / (q[1] - p[1])) * (q[0] - p[0]) > x;
  }, false);

// The polygons of a mask, one for each connected part with its holes, each of at most `maxPoints` points.
// `tolerance`: px that a border may move; parts and holes below `leastArea` px are left out.
export const polygonsOfMask = (mask: Mask, tolerance: number, leastArea = 0): Point[][] => {
  const loops = loopsOfMask(mask).filter((loop) => Math.abs(doubleArea(loop)) / 2 >= leastArea);
  const outer = loops.filter((loop) => doubleArea(loop) > 0).sort((x, y) => doubleArea(x) - doubleArea(y));
  const parts = outer.map((loop) => [loop]);
  for (const hole of loops.filter((loop) => doubleArea(loop) < 0)) {
    // The first corner is the upper left one of the hole's first pixel. The smallest loop around has the hole.
    const pixel: Point = [hole[0][0] + 1e-3, hole[0][1] + 1e-3];
    parts.find(([loop]) => inside(loop, pixel))?.push(hole);
  }
  return parts.flatMap((part) => {
    for (let loose = tolerance; ; loose = Math.max(1, 1.5 * loose)) {
      const polygon = joined(part.map((loop) => simplifiedLoop(loop, loose)).filter((loop) => loop.length > 2));
      if (polygon.length < 3) return [];
      if (polygon.length <= maxPoints) return [polygon];
    }
  });
};
