import assert from 'node:assert/strict';
import test from 'node:test';

import { plainGain } from '../model/tone';
import { differenceOf } from './changes';

test('a difference is a and b, pixel after pixel, without rounding', () => {
  const before = [128, 128, 0, 255, 130, 120, 0, 255];
  const after = [148, 108, 0, 255, 131, 120, 0, 255];
  assert.deepEqual([...differenceOf(before, after, plainGain)], [20, -20, 0, 0]);
  assert.deepEqual([...differenceOf(before, after, [0.5, 9, 2, 9])], [10, -40, 0, 0]);
  assert.deepEqual([...differenceOf([0, 0, 0, 0], [255, 255, 0, 0], plainGain)], [127, 127]);
});
