import assert from 'node:assert/strict';
import { test } from 'node:test';

import { withMoved } from './order';

test('an item moves to its place, and the others keep their order', () => {
  assert.deepEqual(withMoved(['a', 'b', 'c', 'd'], 2, 0), ['c', 'a', 'b', 'd']);
  assert.deepEqual(withMoved(['a', 'b', 'c', 'd'], 0, 1), ['b', 'a', 'c', 'd']);
  assert.deepEqual(withMoved(['a', 'b'], 0, 9), ['b', 'a']);
  assert.deepEqual(withMoved(['a', 'b'], 5, 0), ['a', 'b']);
});
