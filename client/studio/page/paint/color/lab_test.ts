import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import test from 'node:test';

import { chromaOf, hexAtLuminance, hexFromLab, hueOf, labFromHex, luminanceFromBytes, srgbFromLab } from './lab';

const near = (x: number, y: number, tolerance: number) =>
  assert.ok(Math.abs(x - y) <= tolerance, `${x} is not within ${tolerance} of ${y}`);

// Values of core/color/lab.cc: paint_format_test.cc checks the same file.
test('Lab is that of the service', () => {
  const { colors } = JSON.parse(readFileSync(`${process.env.PAINT_FIXTURES}/service.json`, 'utf8'));
  for (const { hex, lab: [l, a, b] } of colors) {
    const lab = labFromHex(hex);
    near(lab.l, l, 1e-6);
    near(lab.a, a, 1e-6);
    near(lab.b, b, 1e-6);
  }
});

test('colours survive the way to Lab and back', () => {
  for (let value = 0; value < 0x1000000; value += 0x10305) {
    const hex = '#' + value.toString(16).padStart(6, '0');
    assert.equal(hexFromLab(labFromHex(hex)), hex);
  }
});

test('greys have no chroma', () => {
  for (const hex of ['#000000', '#808080', '#ffffff']) near(chromaOf(labFromHex(hex)), 0, 1e-9);
  near(luminanceFromBytes(119, 119, 119), labFromHex('#777777').l, 1e-9);
});

test('a colour that sRGB lacks keeps luminance and hue', () => {
  const wanted = { l: 30, a: 60, b: 80 };
  const hex = hexFromLab(wanted);
  const lab = labFromHex(hex);
  near(lab.l, 30, 0.6);
  near(hueOf(lab), hueOf(wanted), 2);
  const { r, g, b } = srgbFromLab(wanted);
  for (const v of [r, g, b]) assert.ok(v >= 0 && v <= 1);
});

test('a colour on the photo has the luminance of the photo', () => {
  for (const l of [10, 45, 60]) near(labFromHex(hexAtLuminance('#a0522d', l)).l, l, 0.6);
});
