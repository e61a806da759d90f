import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import test from 'node:test';

import { edgeWeight, smoothed, type Luminance } from './edge_weights';
import { regionSigma, regionWithin, resistanceFrom, toll } from './grow';

// paint_format_test.cc checks the same file against core/grid/edge_weights.cc.
test('edge weights are those of the service', () => {
  const { edges } = JSON.parse(readFileSync(`${process.env.PAINT_FIXTURES}/service.json`, 'utf8'));
  const { width, height, sigma } = edges;
  const { data } = smoothed({ width, height, data: Float32Array.from(edges.luminance as number[]) });
  const near = (found: number, wanted: number) => assert.ok(Math.abs(found - wanted) < 1e-5, `${found} ${wanted}`);
  for (let y = 0; y < height; ++y) {
    for (let x = 0; x < width; ++x) {
      const i = y * width + x;
      if (x + 1 < width) near(edgeWeight(data[i], data[i + 1], sigma), edges.right[i]);
      if (y + 1 < height) near(edgeWeight(data[i], data[i + width], sigma), edges.down[i]);
    }
  }
});

const scene = (side: number, value: (x: number, y: number) => number): Luminance => ({
  width: side, height: side,
  data: Float32Array.from({ length: side * side }, (_, i) => value(i % side, Math.floor(i / side))),
});

test('a region ends at an edge and fills a textured surface', () => {
  const side = 96;
  let seed = 11;
  const grain = () => ((seed = (seed * 48271) % 2147483647) % 300) / 100;
  const inDisc = (x: number, y: number) => Math.hypot(x - 48, y - 48) < 30;
  const picture = scene(side, (x, y) => (inDisc(x, y) ? 60 : 35) + grain());
  const far = resistanceFrom(picture, 48, 48, 20);
  const { data } = regionWithin(far, side, side, 4);
  let wrong = 0, inner = 0, found = 0;
  data.forEach((v, i) => {
    const r = Math.hypot((i % side) - 48, Math.floor(i / side) - 48);
    if (v && r > 31) ++wrong;
    if (r < 27) {
      ++inner;
      found += v;
    }
  });
  assert.equal(wrong, 0);
  assert.ok(found > 0.97 * inner, `${found} of ${inner}`);
});

test('resistance is the shortest way, and more reach is more area', () => {
  const side = 40;
  const picture = scene(side, (x, y) => 50 + 8 * Math.sin(x / 4) + 5 * Math.cos(y / 3));
  const far = resistanceFrom(picture, 7, 9, 1e6);
  const smooth = smoothed(picture).data;
  const seed = far.indexOf(0);
  assert.ok(Math.hypot((seed % side) - 7, Math.floor(seed / side) - 9) < 6);
  // Every pixel but the seed is reached by its best neighbour's way and one step.
  for (let y = 1; y < side - 1; ++y) {
    for (let x = 1; x < side - 1; ++x) {
      const i = y * side + x;
      if (i === seed) continue;
      let best = Infinity;
      for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [1, -1], [-1, 1], [-1, -1]]) {
        const j = i + dy * side + dx;
        best = Math.min(best, far[j] + Math.hypot(dx, dy) * (1 / edgeWeight(smooth[i], smooth[j], regionSigma) - 1 + toll));
      }
      assert.ok(Math.abs(best - far[i]) < 1e-3 * (1 + far[i]));
    }
  }
  const area = (reach: number) => regionWithin(far, side, side, reach).data.reduce((sum, v) => sum + v, 0);
  assert.ok(area(0.2) <= area(1) && area(1) <= area(10));
});

test('a click beside a line means the surface', () => {
  const far = resistanceFrom(scene(30, (x) => (x === 15 ? 20 : 80)), 16, 12, 5);
  assert.ok(far[12 * 30 + 25] < 1);
});

test('a limited reach stops the search', () => {
  const far = resistanceFrom(scene(30, (x) => (x < 15 ? 20 : 80)), 3, 3, 5);
  assert.equal(far[3 * 30 + 25], Infinity);
});
