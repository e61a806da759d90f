// The region tool: how far each pixel is from a seed when edges are obstacles. The resistance of a step is its length
// times 1 / weight - 1 of the service's edge weights, with a small toll for length, so that a smooth surface is all
// near and a contour far.
import type { Mask } from '../raster/mask';
import { edgeWeight, smoothed, type Luminance } from './edge_weights';

// Differences of L that are still one surface to a person; the service's own sigma is meant for thousands of
// iterations of smoothing.
export const regionSigma = 3;
const toll = 0.004;
const buckets = 1024;

// The distances from pixel (x, y) up to `limit`; Infinity beyond.
export const resistanceFrom = (luminance: Luminance, x: number, y: number, limit: number): Float32Array => {
  const { width: w, height: h } = luminance;
  const smooth = smoothed(luminance).data;
  const far = new Float32Array(w * h).fill(Infinity);
  const waiting: number[][] = Array.from({ length: buckets + 1 }, () => []);
  const bucketOf = (d: number) => Math.floor((d / limit) * buckets);
  const neighbors: [number, number, number][] = [];
  for (let dy = -1; dy <= 1; ++dy) {
    for (let dx = -1; dx <= 1; ++dx) if (dx || dy) neighbors.push([dx, dy, Math.hypot(dx, dy)]);
  }
  far[y * w + x] = 0;
  waiting[0].push(y * w + x);
  for (let b = 0; b <= buckets; ++b) {
    // Grows while it is walked: a step may end in the bucket that it began in.
    for (let k = 0; k < waiting[b].length; ++k) {
      const i = waiting[b][k];
      if (bucketOf(far[i]) !== b) continue;
      const px = i % w, py = (i - px) / w;
      for (const [dx, dy, length] of neighbors) {
        const qx = px + dx, qy = py + dy;
        if (qx < 0 || qy < 0 || qx >= w || qy >= h) continue;
        const j = i + dy * w + dx;
        const d = Math.fround(far[i] + length * (1 / edgeWeight(smooth[i], smooth[j], regionSigma) - 1 + toll));
        if (d > limit || d >= far[j]) continue;
        far[j] = d;
        waiting[bucketOf(d)].push(j);
      }
    }
    waiting[b] = [];
  }
  return far;
};

// The pixels within `reach`, without specks: a pixel follows the majority of its 3x3 neighbourhood, and the border
// steps back by one pixel, since what lies there belongs to two things.
export const regionWithin = (far: Float32Array, width: number, height: number, reach: number): Mask => {
  const raw = new Uint8Array(width * height);
  for (let i = 0; i < raw.length; ++i) raw[i] = far[i] <= reach ? 1 : 0;
  const counted = (source: Uint8Array, least: number): Uint8Array => {
    const out = new Uint8Array(source.length);
    for (let y = 0; y < height; ++y) {
      const above = Math.max(y - 1, 0) * width, here = y * width, below = Math.min(y + 1, height - 1) * width;
      for (let x = 0; x < width; ++x) {
        const l = Math.max(x - 1, 0), r = Math.min(x + 1, width - 1);
        const sum = source[above + l] + source[above + x] + source[above + r] + source[here + l] + source[here + x] +
          source[here + r] + source[below + l] + source[below + x] + source[below + r];
        out[here + x] = sum >= least ? 1 : 0;
      }
    }
    return out;
  };
  const closed = counted(counted(counted(raw, 5), 4), 5);
  const inner = counted(closed, 8);
  return { x: 0, y: 0, width, height, data: inner.includes(1) ? inner : raw };
};
