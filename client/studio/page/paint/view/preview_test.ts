import assert from 'node:assert/strict';
import test from 'node:test';

import type { StrokeFile } from '../model/stroke_file';
import { PreviewLoop, type PreviewState } from './preview';

const dot = (x: number): StrokeFile => [{ x, y: 0, color: '#000000' }];
const pause = (ms: number) => new Promise((done) => setTimeout(done, ms));
class Picture {
  isClosed = false;
  constructor(readonly of: StrokeFile) {}
  close() {
    this.isClosed = true;
  }
}
const loopOf = (source: (strokes: StrokeFile, side: number, signal: AbortSignal) => Promise<Picture>) => {
  const pictures: (Picture | null)[] = [];
  const states: PreviewState[] = [];
  const loop = new PreviewLoop(
    source as unknown as (strokes: StrokeFile, side: number, signal: AbortSignal) => Promise<ImageBitmap>,
    { picture: (bitmap) => pictures.push(bitmap as unknown as Picture | null), state: (state) => states.push(state) },
    10);
  return { loop, pictures, states };
};

test('changes in quick succession ask once, for the last', async () => {
  const asked: StrokeFile[] = [];
  const { loop, pictures } = loopOf(async (strokes) => {
    asked.push(strokes);
    return new Picture(strokes);
  });
  for (let i = 0; i < 5; ++i) loop.changed(dot(i), 100);
  await pause(40);
  assert.deepEqual(asked, [dot(4)]);
  assert.deepEqual(pictures.map((picture) => picture?.of), [dot(4)]);
});

test('while one is under way the newest strokes wait, and only they are asked for next', async () => {
  const asked: StrokeFile[] = [];
  const { loop, pictures, states } = loopOf(async (strokes) => {
    asked.push(strokes);
    await pause(40);
    return new Picture(strokes);
  });
  loop.changed(dot(1), 100);
  await pause(25);
  for (let i = 2; i < 6; ++i) loop.changed(dot(i), 100);
  await pause(130);
  assert.deepEqual(asked, [dot(1), dot(5)]);
  assert.deepEqual(pictures.map((picture) => picture?.of), [dot(1), dot(5)]);
  assert.equal(states.filter((state) => state === 'shown').length, 1);
});

test('what is stopped is withdrawn, and its late picture is not shown', async () => {
  const late: Picture[] = [];
  let aborted = 0;
  const { loop, pictures } = loopOf(async (strokes, _, signal) => {
    signal.addEventListener('abort', () => ++aborted);
    await pause(40);
    const picture = new Picture(strokes);
    late.push(picture);
    return picture;
  });
  loop.changed(dot(1), 100);
  await pause(25);
  loop.changed([], 100);
  await pause(60);
  assert.equal(aborted, 1);
  assert.deepEqual(pictures, [null]);
  assert.deepEqual(late.map(({ isClosed }) => isClosed), [true]);
});

test('a failure is told, and the next change tries anew', async () => {
  let fails = true;
  const { loop, states } = loopOf(async (strokes) => {
    if (fails) throw new Error('the server is away');
    return new Picture(strokes);
  });
  loop.changed(dot(1), 100);
  await pause(30);
  fails = false;
  loop.changed(dot(2), 100);
  await pause(30);
  assert.deepEqual(states, ['waiting', 'failed', 'waiting', 'shown']);
});

test('without strokes there is no preview', async () => {
  const { loop, pictures, states } = loopOf(async (strokes) => new Picture(strokes));
  loop.changed(dot(1), 100);
  loop.changed([], 100);
  await pause(30);
  assert.deepEqual(pictures, [null]);
  assert.equal(states.at(-1), 'none');
});
