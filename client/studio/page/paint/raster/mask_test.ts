import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import test from 'node:test';

import { parseStrokes } from '../model/stroke_file';
import { covers, maskOf } from './mask';

// paint_format_test.cc checks the same file against core/keycolor/hints/hint_map.cc.
test('entries cover the pixels that the service gives their colour', () => {
  const fixtures = process.env.PAINT_FIXTURES;
  const strokes = parseStrokes(readFileSync(`${fixtures}/strokes.json`, 'utf8'));
  const { width, height, coverage } = JSON.parse(readFileSync(`${fixtures}/service.json`, 'utf8'));
  const owner = new Array<string>(width * height).fill('.');
  strokes.forEach((entry, index) => {
    const mask = maskOf(entry, { width, height });
    for (let y = 0; y < mask.height; ++y) {
      for (let x = 0; x < mask.width; ++x) {
        if (mask.data[y * mask.width + x]) owner[(mask.y + y) * width + mask.x + x] = index.toString(36);
      }
    }
  });
  const rows = Array.from({ length: height }, (_, y) => owner.slice(y * width, (y + 1) * width).join(''));
  assert.deepEqual(rows, coverage);
});

test('a place inside of an entry is found', () => {
  const line = { line: [[10, 10], [30, 10]], width: 6 } as const;
  assert.ok(covers(line, 20, 12.9));
  assert.ok(!covers(line, 20, 13.1));
  assert.ok(covers({ x: 5, y: 5, radius: 3 }, 7, 5));
  const ring = { region: [[0, 0], [9, 0], [9, 9], [0, 9], [0, 0], [3, 3], [6, 3], [6, 6], [3, 6], [3, 3]] } as const;
  assert.ok(covers(ring, 1, 1));
  assert.ok(!covers(ring, 4, 4));
  assert.ok(!covers({ label: 1 }, 4, 4));
});
