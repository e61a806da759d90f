// The region tool: how far each pixel is from a seed when edges are obstacles. The resistance of a step is its length
// times 1 / weight - 1 of the service's edge weights, with a small toll for length, so that a smooth surface is all
// near and a contour far.
import type { Mask } from '../raster/mask';
import { edgeWeight, smoothed, type Luminance } from './edge_weights';

// Between the differences of L in a smooth surface and those in a textured one (tried on the banana's carpet). The
// service's own 0.5 is meant for a solution over the whole photo, not for a single way.
export const regionSigma = 2;
export const toll = 0.004;
const seedRadius = 4; // px around the seed, of which the calmest counts
const buckets = 1024;
const largestHole = 80; // px that are filled, as spots on a surface are

// The pixel near (x, y) that is most like those around it: who clicks beside a line means the surface.
const calmest = (smooth: Float32Array, w: number, h: number, x: number, y: number): number => {
  let best = y * w + x, least = Infinity;
  for (let qy = Math.max(1, y - seedRadius); qy <= Math.min(h - 2, y + seedRadius); ++qy) {
    for (let qx = Math.max(1, x - seedRadius); qx <= Math.min(w - 2, x + seedRadius); ++qx) {
      const i = qy * w + qx;
      const unrest = [1, -1, w, -w].reduce((sum, d) => sum + 1 / edgeWeight(smooth[i], smooth[i + d], regionSigma), 0) +
        1e-3 * Math.hypot(qx - x, qy - y);
      if (unrest >= least) continue;
      least = unrest;
      best = i;
    }
  }
  return best;
};

// The distances from pixel (x, y) up to `limit`; Infinity beyond.
export const resistanceFrom = (luminance: Luminance, x: number, y: number, limit: number): Float32Array => {
  const { width: w, height: h } = luminance;
  const smooth = smoothed(luminance).data;
  const far = new Float32Array(w * h).fill(Infinity);
  const waiting: number[][] = Array.from({ length: buckets + 1 }, () => []);
  const bucketOf = (d: number) => Math.floor((d / limit) * buckets);
  // Right, left, down, up, and the diagonal ones.
  const dx = [1, -1, 0, 0, 1, -1, 1, -1], dy = [0, 0, 1, -1, 1, 1, -1, -1];
  const length = dx.map((v, k) => Math.hypot(v, dy[k]));
  const seed = calmest(smooth, w, h, x, y);
  far[seed] = 0;
  waiting[0].push(seed);
  for (let b = 0; b <= buckets; ++b) {
    // Grows while it is walked: a step may end in the bucket that it began in.
    const now = waiting[b];
    for (let n = 0; n < now.length; ++n) {
      const i = now[n];
      const here = far[i];
      if (bucketOf(here) !== b) continue;
      const px = i % w, py = (i - px) / w;
      for (let k = 0; k < 8; ++k) {
        const qx = px + dx[k], qy = py + dy[k];
        if (qx < 0 || qy < 0 || qx >= w || qy >= h) continue;
        const j = qy * w + qx;
        if (far[j] <= here) continue;
        const d = Math.fround(here + length[k] * (1 / edgeWeight(smooth[i], smooth[j], regionSigma) - 1 + toll));
        if (d > limit || d >= far[j]) continue;
        far[j] = d;
        waiting[bucketOf(d)].push(j);
      }
    }
    waiting[b] = [];
  }
  return far;
};

// For each pixel whether at least `least` of the nine around and under it are set.
const counted = (source: Uint8Array, width: number, height: number, least: number): Uint8Array => {
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
// Sets the parts that are not set and smaller than `limit` px.
const withoutHoles = (source: Uint8Array, width: number, limit: number): Uint8Array => {
  const out = source.slice();
  const seen = source.slice();
  const part = new Int32Array(source.length);
  let count = 0;
  const take = (i: number) => {
    if (seen[i]) return;
    seen[i] = 1;
    part[count++] = i;
  };
  for (let start = 0; start < seen.length; ++start) {
    count = 0;
    take(start);
    for (let n = 0; n < count; ++n) {
      const i = part[n], x = i % width;
      if (x > 0) take(i - 1);
      if (x + 1 < width) take(i + 1);
      if (i >= width) take(i - width);
      if (i + width < seen.length) take(i + width);
    }
    if (count < limit) for (let n = 0; n < count; ++n) out[part[n]] = 1;
  }
  return out;
};
const area = (source: Uint8Array): number => {
  let sum = 0;
  for (const v of source) sum += v;
  return sum;
};

// The pixels within `reach`, without specks, small holes and threads into the surroundings; the border steps back by a
// pixel, since what lies there belongs to two things.
export const regionWithin = (far: Float32Array, width: number, height: number, reach: number): Mask => {
  const next = (source: Uint8Array, least: number) => counted(source, width, height, least);
  const raw = new Uint8Array(far.length);
  for (let i = 0; i < raw.length; ++i) raw[i] = far[i] <= reach ? 1 : 0;
  const closed = withoutHoles(next(next(next(raw, 5), 4), 5), width, largestHole);
  const stepped = next(closed, 8);
  const opened = next(next(next(next(next(closed, 9), 9), 9), 1), 1);
  const data = 2 * area(opened) > area(stepped) ? opened : area(stepped) > 0 ? stepped : raw; // thin things stay
  return { x: 0, y: 0, width, height, data };
};
