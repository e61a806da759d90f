import assert from 'node:assert/strict';
import test from 'node:test';

import { histogramOf, leastReach, mostReach, reached, reachOfSlider, sliderOfReach, touchedShare } from './heat';

test('a smaller reach narrows, a larger one widens, and both keep the painted place', () => {
  for (const reach of [0.1, 0.5, 1, 2]) assert.equal(reached(1, reach), 1);
  assert.ok(reached(0.5, 0.5) < 0.5 && reached(0.5, 2) > 0.5);
  assert.equal(reached(0.5, 1), 0.5);
  assert.equal(reached(0, 2), 0);
});

test('the share that is touched grows with the reach', () => {
  const histogram = histogramOf(Uint8Array.from({ length: 256 }, (_, i) => i));
  let last = 0;
  for (const reach of [0.1, 0.3, 1, 2]) {
    const share = touchedShare(histogram, reach);
    assert.ok(share > last && share < 1, `${reach}: ${share}`);
    last = share;
  }
});

test('a histogram takes every fourth value of pixels', () => {
  const histogram = histogramOf(new Uint8ClampedArray([255, 0, 0, 255, 0, 0, 0, 255]), 4);
  assert.equal(histogram[255], 0.5);
  assert.equal(histogram[0], 0.5);
});

test('the slider has a reach of 1 in its middle', () => {
  assert.equal(reachOfSlider(0.5), 1);
  for (const at of [0, 0.2, 0.5, 0.9, 1]) assert.ok(Math.abs(sliderOfReach(reachOfSlider(at)) - at) < 1e-9);
  assert.ok(Math.abs(reachOfSlider(0) - leastReach) < 1e-12 && Math.abs(reachOfSlider(1) - mostReach) < 1e-12);
});
