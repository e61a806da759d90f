import assert from 'node:assert/strict';
import test from 'node:test';

import { commandBetween, StrokeDocument } from './document';
import type { StrokeEntry } from './stroke_file';

const dot = (x: number): StrokeEntry => ({ x, y: 0, color: '#000000' });

test('a command has only what changes', () => {
  const [a, b, c, d] = [1, 2, 3, 4].map(dot);
  const command = commandBetween('erase', [a, b, c, d], [a, c, d]);
  assert.deepEqual(command, { name: 'erase', at: 1, removed: [b], added: [] });
  assert.deepEqual(commandBetween('none', [a, b], [a, b]), { name: 'none', at: 2, removed: [], added: [] });
  assert.deepEqual(commandBetween('twice', [a], [a, a]), { name: 'twice', at: 1, removed: [], added: [a] });
});

test('every state comes back by undo and redo', () => {
  const document = new StrokeDocument();
  const states = [document.entries];
  let seed = 7;
  const next = (limit: number) => (seed = (seed * 48271) % 2147483647) % limit;
  for (let i = 0; i < 2000; ++i) {
    const entries = [...document.entries];
    if (next(3) > 0 || entries.length === 0) document.add('add', [dot(i)]);
    else document.replaceAll('erase', entries.filter((_, k) => k !== next(entries.length) || k === 0).slice(next(2)));
    if (document.entries !== states.at(-1)) states.push(document.entries);
  }
  for (let k = states.length - 2; k >= 0; --k) {
    document.undo();
    assert.deepEqual(document.entries, states[k]);
  }
  assert.equal(document.undo(), undefined);
  for (let k = 1; k < states.length; ++k) {
    document.redo();
    assert.deepEqual(document.entries, states[k]);
  }
  assert.equal(document.redo(), undefined);
});

test('what was undone is gone after the next stroke', () => {
  const document = new StrokeDocument();
  document.add('first', [dot(1)]);
  document.add('second', [dot(2)]);
  assert.equal(document.undoName, 'second');
  document.undo();
  assert.equal(document.redoName, 'second');
  document.add('third', [dot(3)]);
  assert.equal(document.redoName, undefined);
  assert.deepEqual(document.entries, [dot(1), dot(3)]);
});

test('loading forgets the history, and only loading says so', () => {
  const heard: boolean[] = [];
  const document = new StrokeDocument((isReset) => heard.push(isReset));
  document.add('first', [dot(1)]);
  document.reset([dot(2)]);
  assert.equal(document.undo(), undefined);
  assert.deepEqual(document.entries, [dot(2)]);
  assert.deepEqual(heard, [false, true]);
});

test('a long history holds each entry once', () => {
  const document = new StrokeDocument();
  for (let i = 0; i < 5000; ++i) document.add('add', [dot(i)]);
  const held = document.commands.reduce((sum, { added, removed }) => sum + added.length + removed.length, 0);
  assert.equal(held, 5000);
});
