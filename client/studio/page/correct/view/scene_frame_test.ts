import assert from 'node:assert/strict';
import test from 'node:test';

import { readMessage } from './scene_frame';

test('messages of a page of a scene are read', () => {
  assert.deepEqual(readMessage({ color3d: 'ready', photos: ['a'] }), { kind: 'ready' });
  assert.deepEqual(readMessage({ color3d: 'recolored' }), { kind: 'recolored' });
  assert.deepEqual(readMessage({ color3d: 'drawn' }), { kind: 'drawn' });
  assert.deepEqual(readMessage({ color3d: 'held', photo: null }), { kind: 'held', photo: null });
  assert.deepEqual(readMessage({ color3d: 'picked', photo: 'a.jpg', x: 0.25, y: 1 }), { kind: 'picked', photo: 'a.jpg', x: 0.25, y: 1 });
});

test('all others are ignored', () => {
  const bad = [null, undefined, 'ready', 7, [], {}, { color3d: 'picked' }, { color3d: 'picked', photo: '', x: 0, y: 0 },
    { color3d: 'picked', photo: 'a', x: -0.1, y: 0 }, { color3d: 'picked', photo: 'a', x: NaN, y: 0 },
    { color3d: 'picked', photo: 'a', x: '0', y: 0 }, { color3d: 'picked', photo: { toString: () => 'a' }, x: 0, y: 0 },
    { color3d: 'held' }, { color3d: 'held', photo: 'x'.repeat(2000) }, { color3d: 'show', tone: [1, 0, 1, 0] }];
  for (const message of bad) assert.equal(readMessage(message), null, JSON.stringify(message));
});
