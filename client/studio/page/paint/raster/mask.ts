// Which pixels an entry covers: the same pixels as core/keycolor/hints/hint_map.cc gives a colour.
import { defaultRadius, halfWidth, isDisc, isLine, isRegion, type Point, type Shape } from '../model/stroke_file';

// A part of the photo; `data` has a byte for each pixel, 1 inside.
export interface Mask {
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
  readonly data: Uint8Array;
}
export interface Size {
  readonly width: number;
  readonly height: number;
}
export interface Box {
  readonly left: number;
  readonly top: number;
  readonly right: number;
  readonly bottom: number;
}

export const boxOfPoints = (points: readonly Point[], margin = 0): Box => {
  let left = Infinity, top = Infinity, right = -Infinity, bottom = -Infinity;
  for (const [x, y] of points) {
    left = Math.min(left, x);
    right = Math.max(right, x);
    top = Math.min(top, y);
    bottom = Math.max(bottom, y);
  }
  return { left: left - margin, top: top - margin, right: right + margin, bottom: bottom + margin };
};
// Bounds of a shape, px. A label has none: it covers nothing here.
export const boxOf = (shape: Shape): Box => {
  if (isLine(shape)) return boxOfPoints(shape.line, halfWidth(shape));
  if (isRegion(shape)) return boxOfPoints(shape.region);
  if (isDisc(shape)) return boxOfPoints([[shape.x, shape.y]], shape.radius ?? defaultRadius);
  return boxOfPoints([]);
};
export const boxesMeet = (p: Box, q: Box): boolean =>
  p.left <= q.right && q.left <= p.right && p.top <= q.bottom && q.top <= p.bottom;

const clamp = (v: number, low: number, high: number): number => Math.min(high, Math.max(low, v));

// An empty mask of the photo's pixels under a box, with one more at each side for ends that lie on the border.
const emptyMask = (box: Box, size: Size): Mask => {
  const x = clamp(Math.floor(box.left) - 1, 0, size.width - 1);
  const y = clamp(Math.floor(box.top) - 1, 0, size.height - 1);
  const width = clamp(Math.floor(box.right) + 1, 0, size.width - 1) - x + 1;
  const height = clamp(Math.floor(box.bottom) + 1, 0, size.height - 1) - y + 1;
  if (!(width > 0 && height > 0)) return { x: 0, y: 0, width: 0, height: 0, data: new Uint8Array() };
  return { x, y, width, height, data: new Uint8Array(width * height) };
};

const squaredDistance = (x: number, y: number, p: Point, q: Point): number => {
  const dx = q[0] - p[0], dy = q[1] - p[1];
  const length = dx * dx + dy * dy;
  const t = clamp(length > 0 ? ((x - p[0]) * dx + (y - p[1]) * dy) / length : 0, 0, 1);
  const ex = x - p[0] - t * dx, ey = y - p[1] - t * dy;
  return ex * ex + ey * ey;
};

// A capsule, at least the pixels at its ends.
const drawSegment = (mask: Mask, size: Size, p: Point, q: Point, radius: number): void => {
  const set = (x: number, y: number) => {
    mask.data[(y - mask.y) * mask.width + x - mask.x] = 1;
  };
  const low = (v: number, side: number) => clamp(Math.floor(v - radius), 0, side - 1);
  const high = (v: number, side: number) => clamp(Math.floor(v + radius), 0, side - 1);
  const right = high(Math.max(p[0], q[0]), size.width), bottom = high(Math.max(p[1], q[1]), size.height);
  for (let y = low(Math.min(p[1], q[1]), size.height); y <= bottom; ++y) {
    for (let x = low(Math.min(p[0], q[0]), size.width); x <= right; ++x) {
      if (squaredDistance(x + 0.5, y + 0.5, p, q) <= radius * radius) set(x, y);
    }
  }
  for (const end of [p, q]) {
    set(Math.min(Math.floor(end[0]), size.width - 1), Math.min(Math.floor(end[1]), size.height - 1));
  }
};

const drawPolygon = (mask: Mask, points: readonly Point[]): void => {
  const crossings: number[] = [];
  for (let row = 0; row < mask.height; ++row) {
    const middle = mask.y + row + 0.5;
    crossings.length = 0;
    for (let k = 0; k < points.length; ++k) {
      const p = points[k], q = points[(k + 1) % points.length];
      if (p[1] <= middle === q[1] <= middle) continue;
      crossings.push(p[0] + ((middle - p[1]) / (q[1] - p[1])) * (q[0] - p[0]));
    }
    crossings.sort((x, y) => x - y);
    for (let k = 0; k + 1 < crossings.length; k += 2) {
      const first = Math.max(mask.x, Math.ceil(crossings[k] - 0.5));
      const end = Math.min(mask.x + mask.width, Math.ceil(crossings[k + 1] - 0.5));
      if (end > first) mask.data.fill(1, row * mask.width + first - mask.x, row * mask.width + end - mask.x);
    }
  }
};

// Requires: the shape lies inside the photo.
export const maskOf = (shape: Shape, size: Size): Mask => {
  const mask = emptyMask(boxOf(shape), size);
  if (mask.data.length === 0) return mask;
  if (isLine(shape)) {
    const { line } = shape;
    const radius = halfWidth(shape);
    if (line.length === 1) drawSegment(mask, size, line[0], line[0], radius);
    for (let k = 0; k + 1 < line.length; ++k) drawSegment(mask, size, line[k], line[k + 1], radius);
  } else if (isRegion(shape)) {
    drawPolygon(mask, shape.region);
  } else if (isDisc(shape)) {
    const center: Point = [shape.x, shape.y];
    drawSegment(mask, size, center, center, shape.radius ?? defaultRadius);
  }
  return mask;
};

export const isEmpty = (mask: Mask): boolean => !mask.data.includes(1);

const crossesLeft = (points: readonly Point[], x: number, y: number): boolean => {
  let inside = false;
  for (let k = 0; k < points.length; ++k) {
    const p = points[k], q = points[(k + 1) % points.length];
    if (p[1] <= y === q[1] <= y) continue;
    if (p[0] + ((y - p[1]) / (q[1] - p[1])) * (q[0] - p[0]) <= x) inside = !inside;
  }
  return inside;
};
// Whether the shape covers a place of the photo, px.
export const covers = (shape: Shape, x: number, y: number): boolean => {
  const box = boxOf(shape);
  if (x < box.left || x > box.right || y < box.top || y > box.bottom) return false;
  if (isRegion(shape)) return crossesLeft(shape.region, x, y);
  if (isDisc(shape)) {
    return squaredDistance(x, y, [shape.x, shape.y], [shape.x, shape.y]) <= (shape.radius ?? defaultRadius) ** 2;
  }
  if (!isLine(shape)) return false;
  const { line } = shape;
  const limit = halfWidth(shape) ** 2;
  if (line.length === 1) return squaredDistance(x, y, line[0], line[0]) <= limit;
  return line.some((p, k) => k + 1 < line.length && squaredDistance(x, y, p, line[k + 1]) <= limit);
};
