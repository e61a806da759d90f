import assert from 'node:assert/strict';
import { test } from 'node:test';

import { asChoices, nextView, withKey, withoutKey } from './key_list';

const key = (view: string, color = 'automatic') => ({ key_view: view, color });

test('a photo is in the list once, with its last colours', () => {
  const keys = withKey(withKey(withKey([], key('a')), key('b')), key('a', 'strokes'));
  assert.deepEqual(keys, [key('a', 'strokes'), key('b')]);
  assert.deepEqual(withoutKey(keys, 'a'), [key('b')]);
});

test('the next photo is the first that is not coloured', () => {
  assert.equal(nextView([key('a')], ['a', 'b', 'c']), 'b');
  assert.equal(nextView([key('a')], ['a']), undefined);
});

test('a run is told the first photo and the others', () => {
  assert.deepEqual(asChoices([key('a')]), key('a'));
  assert.deepEqual(asChoices([key('a'), key('b')]), { ...key('a'), further: [key('b')] });
});
