import assert from 'node:assert/strict';
import test from 'node:test';

import { colorName, correctionNames } from './names';

test('colours have the names that people give them', () => {
  const expected: Record<string, string> = {
    '#c81e1e': 'red', '#e8821a': 'orange', '#f2d21b': 'yellow', '#2f8f3a': 'green', '#2b5fc4': 'blue', '#7a4a22': 'brown',
    '#808080': 'grey', '#ffffff': 'white', '#000000': 'black', '#1f9c98': 'turquoise', '#e387a9': 'pink',
  };
  for (const [hex, name] of Object.entries(expected)) assert.equal(colorName(hex), name, hex);
});

test('corrections are named by colour and photo, equal names are numbered', () => {
  const brown = { view: 'images/a.1.jpg', strokes: [{ x: 1, y: 1, radius: 2, color: '#7a4a22' }] };
  const gray = { view: 'b.png', strokes: [{ line: [[1, 1]] as [number, number][], width: 2, keep: 'neutral' as const }] };
  assert.deepEqual(correctionNames([brown, gray, brown, { view: 'b.png', strokes: null }]),
    ['Brown on a.1 (1)', 'Grey on b', 'Brown on a.1 (2)', 'Painted picture on b']);
});
