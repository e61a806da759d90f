import assert from 'node:assert/strict';
import test from 'node:test';

import { isLine, type StrokeEntry } from '../model/stroke_file';
import { entriesOfPath, runsInside, snapped, widthAt, type Sample } from './path';

const size = { width: 100, height: 60 };
const at = (x: number, y: number, pressure = 0.5): Sample => ({ x, y, pressure });
const brush = { width: 8, withPressure: false, fill: { color: '#112233' }, tolerance: 0.5 } as const;

test('a click is a disc, inside of the photo', () => {
  assert.deepEqual(entriesOfPath([at(10.04, 20.06)], brush, size), [{ x: 10, y: 20.1, radius: 4, color: '#112233' }]);
  assert.deepEqual(entriesOfPath([at(99.99, 20)], brush, size), [{ x: 99.9, y: 20, radius: 4, color: '#112233' }]);
  assert.deepEqual(entriesOfPath([at(100, 20)], brush, size), []);
});

test('a straight way needs two points', () => {
  const way = Array.from({ length: 50 }, (_, i) => at(10 + i, 20 + i / 2));
  assert.deepEqual(entriesOfPath(way, brush, size), [{ line: [[10, 20], [59, 44.5]], width: 8, color: '#112233' }]);
});

test('a way out of the photo and back is two lines up to the border', () => {
  const way = [at(90, 10), at(110, 10), at(110, 30), at(90, 30)];
  assert.deepEqual(runsInside(way, size).map((run) => run.map(({ x, y }) => [x, y])),
    [[[90, 10], [100, 10]], [[100, 30], [90, 30]]]);
  assert.deepEqual(runsInside([at(-5, -5), at(-5, 80)], size), []);
});

test('pressure makes lines of few widths that touch', () => {
  const way = Array.from({ length: 80 }, (_, i) => at(10 + i, 30, i / 79));
  const lines = entriesOfPath(way, { ...brush, withPressure: true }, size);
  assert.ok(lines.length > 3 && lines.length < 10, String(lines.length));
  for (let k = 1; k < lines.length; ++k) {
    const before = lines[k - 1] as StrokeEntry, line = lines[k];
    assert.ok(isLine(before) && isLine(line));
    assert.deepEqual(line.line[0], before.line.at(-1));
    assert.ok(line.width! > before.width!);
  }
  assert.equal(widthAt(8, 1), 8);
  assert.equal(widthAt(8, 0), 2);
});

test('a held angle is a multiple of 15 degrees', () => {
  const { x, y } = snapped(at(0, 0), at(10, 0.8));
  assert.ok(Math.abs(y) < 1e-9 && Math.abs(x - Math.hypot(10, 0.8)) < 1e-9);
});
