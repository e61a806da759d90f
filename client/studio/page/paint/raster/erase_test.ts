import assert from 'node:assert/strict';
import test from 'node:test';

import type { StrokeEntry } from '../model/stroke_file';
import { erased } from './erase';
import { maskOf } from './mask';

const size = { width: 60, height: 40 };
const pixels = (entries: readonly StrokeEntry[]): Set<number> => {
  const found = new Set<number>();
  for (const entry of entries) {
    const mask = maskOf(entry, size);
    mask.data.forEach((v, i) => {
      if (v) found.add((mask.y + Math.floor(i / mask.width)) * size.width + mask.x + (i % mask.width));
    });
  }
  return found;
};

test('the eraser takes what it passes over and nothing else', () => {
  const strokes: StrokeEntry[] = [
    { line: [[5, 20], [55, 20]], width: 10, color: '#aa0000' },
    { x: 30, y: 20, radius: 4, keep: 'neutral' },
    { region: [[0, 0], [60, 0], [60, 40], [0, 40]], color: '#0000aa' },
  ];
  const eraser = { line: [[25, 5], [35, 35]], width: 6 } as const;
  const after = erased(strokes, [eraser], size);
  const gone = pixels([{ ...eraser, color: '#000000' }]);
  for (const fill of ['#aa0000', undefined, '#0000aa']) {
    const of = (list: readonly StrokeEntry[]) => pixels(list.filter((entry) => entry.color === fill));
    assert.deepEqual([...of(after)].sort(), [...of(strokes)].filter((i) => !gone.has(i)).sort());
  }
});

test('untouched strokes stay the same objects, covered ones go', () => {
  const far: StrokeEntry = { x: 55, y: 35, radius: 2, color: '#aa0000' };
  const label: StrokeEntry = { label: 3, color: '#aa0000' };
  const under: StrokeEntry = { x: 10, y: 10, radius: 2, color: '#00aa00' };
  const after = erased([far, under, label], [{ line: [[5, 10], [15, 10]], width: 12 }], size);
  assert.equal(after.length, 2);
  assert.equal(after[0], far);
  assert.equal(after[1], label);
});
