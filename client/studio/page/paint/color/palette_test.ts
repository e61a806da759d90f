import assert from 'node:assert/strict';
import test from 'node:test';

import { distance, labFromHex } from './lab';
import { colorsOfText, paletteOfPicture, withRecent } from './palette';

const pixels = (shares: [string, number][]): Uint8Array => {
  const bytes: number[] = [];
  for (const [hex, count] of shares) {
    const value = parseInt(hex.slice(1), 16);
    for (let i = 0; i < count; ++i) bytes.push(value >> 16, (value >> 8) & 255, value & 255, 255);
  }
  return Uint8Array.from(bytes);
};

test('the colours of a picture are found, small areas too', () => {
  const colors: [string, number][] = [['#c8b060', 5000], ['#3f6f2f', 900], ['#2f5fb0', 300], ['#b03030', 80]];
  const palette = paletteOfPicture(pixels(colors), 6);
  for (const [hex] of colors) {
    const best = Math.min(...palette.map((color) => distance(labFromHex(color), labFromHex(hex))));
    assert.ok(best < 3, `${hex} is missing in ${palette}`);
  }
});

test('a palette is the same each time, and has no colour twice', () => {
  const noise = new Uint8Array(40000);
  let seed = 1;
  for (let i = 0; i < noise.length; ++i) noise[i] = i % 4 === 3 ? 255 : (seed = (seed * 16807) % 2147483647) & 255;
  const first = paletteOfPicture(noise, 12);
  assert.deepEqual(paletteOfPicture(noise, 12), first);
  assert.equal(new Set(first).size, first.length);
  assert.ok(first.length > 6 && first.length <= 12);
});

test('transparent and uniform pictures do no harm', () => {
  assert.deepEqual(paletteOfPicture(new Uint8Array(400), 8), []);
  assert.deepEqual(paletteOfPicture(pixels([['#336699', 50]]), 8), ['#336699']);
});

test('a list of colours is read in any usual form', () => {
  assert.deepEqual(colorsOfText('#A0522D, 87a96b;\n#fff | red #12 #a0522d'),
    { colors: ['#a0522d', '#87a96b', '#ffffff'], rejected: ['red', '#12'] });
});

test('recent colours are each there once, newest first', () => {
  assert.deepEqual(withRecent(['#1', '#2', '#3'], '#2', 3), ['#2', '#1', '#3']);
  assert.deepEqual(withRecent(['#1', '#2', '#3'], '#4', 3), ['#4', '#1', '#2']);
});
