import assert from 'node:assert/strict';
import test from 'node:test';

import { maxPoints, type Point } from '../model/stroke_file';
import { joined, loopsOfPolygon, polygonsOfMask, simplified } from './contour';
import { maskOf, type Mask } from './mask';

const maskFrom = (rows: string[], x = 0, y = 0): Mask => ({
  x, y, width: rows[0].length, height: rows.length,
  data: Uint8Array.from(rows.join(''), (c) => (c === '#' ? 1 : 0)),
});
// The pixels that polygons cover together, of a photo of `side` px.
const drawn = (polygons: Point[][], side: number): string[] => {
  const rows = Array.from({ length: side }, () => new Array<string>(side).fill('.'));
  for (const region of polygons) {
    const mask = maskOf({ region }, { width: side, height: side });
    mask.data.forEach((v, i) => {
      if (v) rows[mask.y + Math.floor(i / mask.width)][mask.x + (i % mask.width)] = '#';
    });
  }
  return rows.map((row) => row.join(''));
};

test('polygons of a mask cover exactly its pixels', () => {
  const cases = [
    ['###', '#.#', '###'],
    ['#.#', '.#.', '#.#'],
    ['#####', '#...#', '#.#.#', '#...#', '#####'],
    ['##..', '#.##', '.##.', '#..#'],
    ['#######', '#.....#', '#.###.#', '#.#.#.#', '#.###.#', '#.....#', '#######'],
  ];
  for (const rows of cases) {
    const side = rows.length;
    assert.deepEqual(drawn(polygonsOfMask(maskFrom(rows), 0), side), rows);
  }
});

test('polygons of random masks cover exactly their pixels', () => {
  let seed = 3;
  for (let round = 0; round < 50; ++round) {
    const rows = Array.from({ length: 24 }, () =>
      Array.from({ length: 24 }, () => ((seed = (seed * 48271) % 2147483647) % 100 < 55 ? '#' : '.')).join(''));
    assert.deepEqual(drawn(polygonsOfMask(maskFrom(rows), 0), 24), rows);
  }
});

test('a part of the photo lies where it was', () => {
  const [polygon] = polygonsOfMask(maskFrom(['##'], 5, 7), 0);
  assert.deepEqual(polygon, [[5, 7], [7, 7], [7, 8], [5, 8]]);
});

test('a polygon comes apart into the loops that it was joined of', () => {
  const loops: Point[][] = [[[0, 0], [9, 0], [9, 9], [0, 9]], [[2, 2], [2, 4], [4, 4]], [[6, 6], [6, 8], [8, 8]]];
  const apart = loopsOfPolygon(joined(loops)).map((loop) => loop.map(String).sort());
  assert.deepEqual(apart.sort(), loops.map((loop) => loop.map(String).sort()).sort());
});

test('simplification keeps within its tolerance', () => {
  const circle = Array.from({ length: 400 }, (_, i): Point => [50 * Math.cos(i / 64), 50 * Math.sin(i / 64)]);
  const fewer = simplified(circle, 0.5);
  assert.ok(fewer.length < 60);
  for (const [x, y] of fewer) assert.ok(Math.abs(Math.hypot(x, y) - 50) < 1e-9);
});

test('a ragged area has no more points than the format allows', () => {
  const side = 400;
  const data = new Uint8Array(side * side);
  let seed = 5;
  for (let y = 1; y < side - 1; ++y) {
    const long = (seed = (seed * 48271) % 2147483647) % side;
    for (let x = 0; x < side; ++x) data[y * side + x] = x < 3 || (x % 2 === 0 && y % 2 === 0 && x < long) ||
      (y % 2 === 1 && x < long) ? 1 : 0;
  }
  for (const polygon of polygonsOfMask({ x: 0, y: 0, width: side, height: side, data }, 0)) {
    assert.ok(polygon.length <= maxPoints);
  }
});
