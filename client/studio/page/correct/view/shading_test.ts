import assert from 'node:assert/strict';
import test from 'node:test';

import { labFromHex } from '../../paint/color/lab';
import { viewPageScript } from '../check/view_page';
import { gainOf, plainGain } from '../model/tone';
import { shade, sourceShades, type Look } from './shading';

const look = (mode: Look['mode'], more: Partial<Look> = {}): Look => ({ mode, gain: plainGain, reach: 1, ...more });
const bytes = (rgb: readonly number[]): number[] => rgb.map((v) => Math.round(255 * v));

test('a colour of the photo comes back from its luminance and its a and b', () => {
  const { l, a, b } = labFromHex('#a0522d');
  const gray = Math.round(255 * ((l + 16) / 116) ** (3 / 2.4) * 1.055 - 255 * 0.055);
  const [red, green, blue] = bytes(shade(gray, [Math.round(a + 128), Math.round(b + 128)], null, 0, look('color')));
  assert.ok(Math.abs(red! - 0xa0) < 4 && Math.abs(green! - 0x52) < 4 && Math.abs(blue! - 0x2d) < 5, `${red} ${green} ${blue}`);
});

test('neutral chroma is the grey photo', () => {
  assert.deepEqual(bytes(shade(120, [128, 128], null, 0, look('color'))), [120, 120, 120]);
  assert.deepEqual(bytes(shade(120, [200, 90], null, 0, look('photo'))), [120, 120, 120]);
});

test('no saturation is grey, warmth is yellow', () => {
  const gray = bytes(shade(120, [170, 90], null, 0, look('color', { gain: gainOf({ saturation: 0, tint: 0, warmth: 0 }) })));
  assert.ok(Math.max(...gray) - Math.min(...gray) <= 1);
  const warm = shade(120, [128, 128], null, 0, look('color', { gain: gainOf({ saturation: 1, tint: 0, warmth: 20 }) }));
  assert.ok(warm[0] > warm[2] + 0.1);
});

test('sources have the shades of the page of a scene', () => {
  const page = viewPageScript('page.js');
  for (const [name, hex] of Object.entries(sourceShades)) {
    assert.match(page, new RegExp(`u${name[0]!.toUpperCase()}${name.slice(1)}: \\['${hex}'`));
  }
  const [, green] = bytes(shade(228, null, [0, 255, 0], 0, look('source')));
  assert.ok(Math.abs(green! - 0xb7) < 3);
});

test('the heat map keeps what is not touched grey, and follows the reach', () => {
  const cold = shade(100, null, null, 0, look('pull'));
  assert.equal(cold[0], cold[2]);
  const warm = shade(100, null, null, 120, look('pull'));
  assert.ok(warm[0] > warm[2] + 0.1);
  const narrow = shade(100, null, null, 120, look('pull', { reach: 0.2 }));
  assert.equal(narrow[0], narrow[2]);
});
