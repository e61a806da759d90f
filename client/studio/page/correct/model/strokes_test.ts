import assert from 'node:assert/strict';
import test from 'node:test';

import { boxOf, strokeOf } from './strokes';

const size = { width: 100, height: 80 };

test('a click is a disc', () => {
  assert.deepEqual(strokeOf([[10, 20]], 8, { color: '#102030' }, size), { color: '#102030', x: 10, y: 20, radius: 4 });
  assert.deepEqual(strokeOf([[10, 20], [10.4, 20.1]], 8, { keep: 'neutral' }, size), { keep: 'neutral', x: 10, y: 20, radius: 4 });
});

test('a path is a line with few points, which ends where the pointer ended', () => {
  const path = Array.from({ length: 200 }, (_, i): [number, number] => [i / 4, 10]);
  const stroke = strokeOf(path, 12, { color: '#ffffff' }, size);
  assert.ok('line' in stroke);
  assert.ok(stroke.line.length < 30);
  assert.deepEqual(stroke.line.at(-1), [49.8, 10]);
});

test('strokes stay within the picture', () => {
  const stroke = strokeOf([[-5, -5], [120, 90]], 4, { color: '#ffffff' }, size);
  assert.deepEqual('line' in stroke && stroke.line, [[0, 0], [99, 79]]);
});

test('the box around strokes lies in the picture', () => {
  assert.deepEqual(boxOf([{ x: 2, y: 2, radius: 4 }], size, 40), { x: 0, y: 0, side: 40 });
  const box = boxOf([{ line: [[10, 10], [90, 70]], width: 10 }], size, 40);
  assert.ok(box.side <= 80 && box.x + box.side <= 100 && box.y + box.side <= 80);
});
