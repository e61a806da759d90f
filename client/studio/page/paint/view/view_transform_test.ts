import assert from 'node:assert/strict';
import test from 'node:test';

import { fitted, maxScale, panned, toPhoto, toScreen, zoomed } from './view_transform';

const photo = { width: 400, height: 300 };
const canvas = { width: 824, height: 524 };

test('a photo that fits is in the middle', () => {
  assert.deepEqual(fitted(photo, canvas), { scale: 500 / 300, x: (824 - (500 / 300) * 400) / 2, y: 12 });
});

test('what is under the pointer stays there', () => {
  let view = fitted(photo, canvas);
  const place = toPhoto(view, 300, 200);
  view = zoomed(view, 3, 300, 200, photo, canvas);
  const [x, y] = toScreen(view, ...place);
  assert.ok(Math.abs(x - 300) < 1e-9 && Math.abs(y - 200) < 1e-9);
});

test('zoom has limits', () => {
  let view = fitted(photo, canvas);
  for (let i = 0; i < 50; ++i) view = zoomed(view, 2, 400, 250, photo, canvas);
  assert.equal(view.scale, maxScale);
  for (let i = 0; i < 50; ++i) view = zoomed(view, 0.5, 400, 250, photo, canvas);
  assert.equal(view.scale, fitted(photo, canvas).scale / 2);
});

test('the photo cannot be lost', () => {
  const view = fitted(photo, canvas);
  for (const [dx, dy] of [[1e5, 0], [-1e5, 0], [0, 1e5], [0, -1e5]]) {
    const moved = panned(view, dx, dy, photo, canvas);
    const [left, top] = toScreen(moved, 0, 0), [right, bottom] = toScreen(moved, 400, 300);
    assert.ok(right >= 200 && left <= 624 && bottom >= 130 && top <= 394, JSON.stringify(moved));
  }
});
