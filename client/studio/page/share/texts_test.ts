import assert from 'node:assert/strict';
import { test } from 'node:test';

import { creditText, frameText, pagesOf, spread, stem } from './texts';

const none = { colored_by: '', key_view_by: '', source: '', licence: '' };

test('a credit reads as the program writes it into pictures', () => {
  assert.equal(creditText(none), 'Colours are inferred.');
  assert.equal(creditText({ colored_by: 'A', key_view_by: 'B', source: 'Archive, No. 7.', licence: 'CC0' }),
    'Coloured by A. Key view by B. Original: Archive, No. 7. Licence: CC0. Colours are inferred.');
});

test('pages of a sheet hold every item once', () => {
  const items = Array.from({ length: 31 }, (_, i) => i);
  const pages = pagesOf(items, 6, 12);
  assert.deepEqual(pages.map((page) => page.length), [6, 12, 12, 1]);
  assert.deepEqual(pages.flat(), items);
  assert.deepEqual(pagesOf([], 6, 12), [[]]);
});

test('a spread keeps order and ends', () => {
  assert.deepEqual(spread([1, 2, 3], 5), [1, 2, 3]);
  assert.deepEqual(spread([0, 1, 2, 3, 4, 5, 6, 7], 4), [0, 2, 4, 6]);
});

test('a stem has neither folder nor ending', () => {
  assert.equal(stem('a/b.c.jpg'), 'b.c');
  assert.equal(stem('a'), 'a');
});

test('frames are counted from one', () => {
  assert.equal(frameText('f000012'), 'Frame 13');
  assert.equal(frameText('001'), '001');
});
