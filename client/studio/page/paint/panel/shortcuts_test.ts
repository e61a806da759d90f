import assert from 'node:assert/strict';
import test from 'node:test';

import { commandOfKey, takesKeys } from './shortcuts';

const press = (key: string, held: Partial<Record<'ctrlKey' | 'metaKey' | 'shiftKey' | 'altKey', boolean>> = {}) =>
  commandOfKey({ key, ctrlKey: false, metaKey: false, shiftKey: false, altKey: false, ...held });

test('keys are those of the list', () => {
  assert.equal(press('b'), 'brush');
  assert.equal(press('B', { shiftKey: true }), 'brush');
  assert.equal(press('z', { ctrlKey: true }), 'undo');
  assert.equal(press('Z', { ctrlKey: true, shiftKey: true }), 'redo');
  assert.equal(press('y', { ctrlKey: true }), 'redo');
  assert.equal(press('z', { metaKey: true }), 'undo');
  assert.equal(press('?', { shiftKey: true }), 'shortcuts');
  assert.equal(press('b', { ctrlKey: true }), undefined);
  assert.equal(press('b', { altKey: true }), undefined);
  assert.equal(press('constructor'), undefined);
});

test('fields keep their keys, sliders and boxes do not', () => {
  assert.ok(takesKeys('INPUT', 'text'));
  assert.ok(takesKeys('TEXTAREA', ''));
  assert.ok(!takesKeys('INPUT', 'range'));
  assert.ok(!takesKeys('BUTTON', 'button'));
});
