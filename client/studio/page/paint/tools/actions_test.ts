import assert from 'node:assert/strict';
import test from 'node:test';

import { StrokeDocument } from '../model/document';
import { isLine, isRegion } from '../model/stroke_file';
import { maskOf } from '../raster/mask';
import { english } from '../texts';
import { beginAction, type ActionInput } from './actions';
import type { Sample } from './path';
import { firstSettings, type Settings } from './settings';

// A photo of 200 x 120 px, bright to the right of x = 100, with its luminance at half the size.
const size = { width: 200, height: 120 };
const setUp = (changes: Partial<Settings>) => {
  const document = new StrokeDocument();
  const settings: Settings = { ...firstSettings(200), width: 8, fill: { color: '#a0522d' }, ...changes };
  const input: ActionInput = {
    document, size, texts: english,
    settings: () => settings,
    scale: () => 1,
    luminance: () => ({
      width: 100, height: 60, data: Float32Array.from({ length: 6000 }, (_, i) => (i % 100 < 50 ? 30 : 70)),
    }),
  };
  return { document, input };
};
const at = (x: number, y: number): Sample => ({ x, y, pressure: 0.5 });

test('a brush stroke is seen while it is drawn, and is one command', () => {
  const { document, input } = setUp({ tool: 'brush' });
  const action = beginAction(input, at(10, 10), false);
  action.extend([at(20, 10), at(30, 10)], false);
  assert.deepEqual(action.entries, [{ line: [[10, 10], [30, 10]], width: 8, color: '#a0522d' }]);
  assert.equal(document.entries.length, 0);
  action.extend([at(30, 40)], false);
  assert.equal(action.end(), undefined);
  assert.deepEqual(document.entries, [{ line: [[10, 10], [30, 10], [30, 40]], width: 8, color: '#a0522d' }]);
  assert.equal(document.undo(), english.brush);
});

test('a line has its ends only', () => {
  const { document, input } = setUp({ tool: 'line' });
  const action = beginAction(input, at(10, 10), false);
  action.extend([at(90, 90), at(60, 12)], true);
  action.end();
  const [entry] = document.entries;
  assert.ok(isLine(entry));
  assert.deepEqual(entry.line[0], [10, 10]);
  assert.equal(entry.line[1][1], 10);
});

test('a region ends at the edge, and its reach follows the drag', () => {
  const { document, input } = setUp({ tool: 'region', fill: { keep: 'neutral' } });
  const action = beginAction(input, at(40, 60), false);
  assert.equal(action.end(), undefined);
  const [entry] = document.entries;
  assert.ok(isRegion(entry) && entry.keep === 'neutral');
  const mask = maskOf(entry, size);
  const covered = mask.data.reduce((sum, v) => sum + v, 0);
  assert.ok(mask.x + mask.width <= 104, String(mask.x + mask.width));
  assert.ok(covered > 0.85 * 100 * 120, String(covered));
  const far = beginAction(input, at(40, 60), false);
  far.extend([at(700, 60)], false);
  const all = far.entries.reduce((sum, one) => sum + maskOf(one, size).data.reduce((s, v) => s + v, 0), 0);
  assert.ok(all >= covered);
});

test('outside of the photo there is no region, and the user hears so', () => {
  const { document, input } = setUp({ tool: 'region' });
  assert.equal(beginAction(input, at(-5, 60), false).end(), english.nothingThere);
  assert.equal(document.entries.length, 0);
});

test('the eraser is one command, undone as a whole', () => {
  const { document, input } = setUp({ tool: 'eraser' });
  document.add('a', [{ line: [[10, 20], [190, 20]], width: 6, color: '#000000' }]);
  document.add('b', [{ x: 100, y: 100, radius: 3, color: '#000000' }]);
  const before = document.entries;
  const action = beginAction(input, at(50, 5), false);
  action.extend([at(50, 60)], false);
  assert.equal(action.eraser.length, 1);
  action.end();
  assert.equal(document.entries.length, 3); // the line in two parts
  assert.equal(document.entries[2], before[1]);
  document.undo();
  assert.deepEqual(document.entries, before);
});

test('only a pen sets the width by its pressure', () => {
  for (const isPen of [true, false]) {
    const { document, input } = setUp({ tool: 'brush' });
    const action = beginAction(input, { x: 10, y: 10, pressure: 0 }, isPen);
    action.extend(Array.from({ length: 40 }, (_, i) => ({ x: 10 + i, y: 10, pressure: i / 39 })), false);
    action.end();
    assert.equal(document.entries.length > 1, isPen);
  }
});
