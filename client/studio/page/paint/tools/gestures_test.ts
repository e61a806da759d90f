import assert from 'node:assert/strict';
import test from 'node:test';

import { Gestures, wheelFactor, type PointerSample } from './gestures';

const setUp = () => {
  const log: string[] = [];
  const gestures = new Gestures({
    begin: ({ x, y }) => log.push(`begin ${x} ${y}`),
    extend: (samples) => log.push(`extend ${samples.map(({ x, y }) => `${x} ${y}`).join(', ')}`),
    end: () => log.push('end'),
    cancel: () => log.push('cancel'),
    pick: ({ x, y }) => log.push(`pick ${x} ${y}`),
    pan: (dx, dy) => log.push(`pan ${dx} ${dy}`),
    zoom: (factor, x, y) => log.push(`zoom ${factor.toFixed(2)} ${x} ${y}`),
  });
  return { log, gestures };
};
const pointer = (id: number, x: number, y: number, type = 'mouse', button = 0): PointerSample =>
  ({ id, type, button, x, y, pressure: 0.5 });

test('the mouse paints, with every place on the way', () => {
  const { log, gestures } = setUp();
  gestures.move([pointer(1, 0, 0)]);
  gestures.down(pointer(1, 1, 2), 0);
  gestures.move([pointer(1, 3, 4), pointer(1, 5, 6)]);
  gestures.up(1);
  assert.deepEqual(log, ['begin 1 2', 'extend 3 4, 5 6', 'end']);
});

test('the middle button and the space bar move the photo', () => {
  const { log, gestures } = setUp();
  gestures.down(pointer(1, 10, 10, 'mouse', 1), 0);
  gestures.move([pointer(1, 15, 12)]);
  gestures.up(1);
  gestures.panKey = true;
  gestures.down(pointer(1, 0, 0), 0);
  gestures.move([pointer(1, -4, 1)]);
  gestures.up(1);
  assert.deepEqual(log, ['pan 5 2', 'pan -4 1']);
});

test('Alt and the second button pick', () => {
  const { log, gestures } = setUp();
  gestures.down(pointer(1, 1, 1, 'mouse', 2), 0);
  gestures.move([pointer(1, 5, 5)]);
  gestures.up(1);
  gestures.pickKey = true;
  gestures.down(pointer(1, 2, 2), 0);
  gestures.up(1);
  assert.deepEqual(log, ['pick 1 1', 'pick 2 2']);
});

test('two fingers zoom and pan, and take back what the first had begun', () => {
  const { log, gestures } = setUp();
  gestures.down(pointer(1, 0, 0, 'touch'), 0);
  gestures.down(pointer(2, 100, 0, 'touch'), 50);
  gestures.move([pointer(2, 200, 0, 'touch')]);
  gestures.up(1);
  gestures.move([pointer(2, 210, 5, 'touch')]);
  gestures.up(2);
  gestures.down(pointer(3, 7, 7, 'touch'), 900);
  gestures.up(3);
  assert.deepEqual(log, ['begin 0 0', 'cancel', 'pan 50 0', 'zoom 2.00 100 0', 'pan 10 5', 'begin 7 7', 'end']);
});

test('a finger that comes late does not spoil the stroke', () => {
  const { log, gestures } = setUp();
  gestures.down(pointer(1, 0, 0, 'touch'), 0);
  gestures.move([pointer(1, 80, 0, 'touch')]);
  gestures.down(pointer(2, 300, 300, 'touch'), 900);
  gestures.move([pointer(2, 310, 300, 'touch')]);
  gestures.move([pointer(1, 90, 0, 'touch')]);
  gestures.up(1);
  gestures.up(2);
  assert.deepEqual(log, ['begin 0 0', 'extend 80 0', 'extend 90 0', 'end']);
});

test('with a pen, a resting hand leaves no marks', () => {
  const { log, gestures } = setUp();
  gestures.down(pointer(1, 5, 5, 'pen'), 0);
  gestures.up(1);
  gestures.down(pointer(2, 50, 50, 'touch'), 10);
  gestures.move([pointer(2, 55, 50, 'touch')]);
  gestures.up(2);
  assert.deepEqual(log, ['begin 5 5', 'end', 'pan 5 0']);
});

test('the eraser of a pen paints as what it is', () => {
  const begun: number[] = [];
  const { gestures } = setUp();
  const target = { begin: ({ button }: PointerSample) => begun.push(button) };
  Object.assign((gestures as unknown as { target: object }).target, target);
  gestures.down(pointer(1, 5, 5, 'pen', 5), 0);
  gestures.up(1);
  assert.deepEqual(begun, [5]);
});

test('a lost pointer takes its stroke with it', () => {
  const { log, gestures } = setUp();
  gestures.down(pointer(1, 5, 5, 'touch'), 0);
  gestures.lost(1);
  gestures.up(1);
  gestures.down(pointer(2, 6, 6, 'touch'), 10);
  assert.deepEqual(log, ['begin 5 5', 'cancel', 'begin 6 6']);
});

test('the wheel zooms evenly in and out', () => {
  assert.ok(Math.abs(wheelFactor(120, 0) * wheelFactor(-120, 0) - 1) < 1e-12);
  assert.ok(wheelFactor(-100, 0) > 1);
  assert.equal(wheelFactor(3, 1), wheelFactor(48, 0));
});
