import assert from 'node:assert/strict';
import test from 'node:test';

import {
  clockOf, evenTimes, frameAt, frameOfName, insideOf, keyOf, limitsOf, markStep, newSpan, partsFit, runsOf, secondsOf,
  shotSpan, stepOf, withEdge, type FilmTimes,
} from './timeline_model';

const film = (shots: number[], perSecond = 10): FilmTimes => ({
  names: shots.map((_, i) => `f${String(i).padStart(6, '0')}.png`), times: evenTimes(shots.length, perSecond), shots,
});
const twoShots = film([...new Array(20).fill(0), ...new Array(30).fill(1)]);
const part = (frame: number, begin: number, end: number) => ({ frame, begin, end });

test('a frame is shown until the next one', () => {
  const { times } = twoShots;
  assert.equal(frameAt(times, 0), 0);
  assert.equal(frameAt(times, 0.0999), 0);
  assert.equal(frameAt(times, 0.1), 1);
  assert.equal(frameAt(times, 1000), 49);
  assert.equal(frameAt(times, -1), 0);
  for (let i = 0; i < times.length; ++i) assert.equal(frameAt(times, insideOf(times, i)), i);
});

test('uneven times have the usual step', () => {
  const times = [0, 0.1, 0.2, 0.9, 1.0];
  assert.ok(Math.abs(stepOf(times) - 0.1) < 1e-9);
  assert.ok(Math.abs(secondsOf(times) - 1.1) < 1e-9);
  assert.equal(frameAt(times, 0.5), 2);
  assert.equal(secondsOf([]), 0);
  assert.equal(frameAt([0], 5), 0);
});

test('names are found with and without their ending', () => {
  assert.equal(frameOfName(twoShots.names, 'f000012.png'), 12);
  assert.equal(frameOfName(twoShots.names, 'f000012'), 12);
  assert.equal(frameOfName(twoShots.names, 'f000099'), -1);
});

test('a torn frame is a run of its own in a shot', () => {
  const shots = [0, 0, 7, 0, 1];
  assert.deepEqual(runsOf(shots).map(({ begin, end }) => [begin, end]), [[0, 1], [2, 2], [3, 3], [4, 4]]);
  assert.deepEqual(shotSpan(shots, 1), { begin: 0, end: 3 });
});

test('a part stays in its shot', () => {
  const parts = [part(10, 5, 15)];
  assert.deepEqual(limitsOf(parts[0]!, parts, twoShots), { begin: 0, end: 19 });
  assert.equal(withEdge(parts, 0, 'end', 40, twoShots)[0]!.end, 19);
  assert.equal(withEdge(parts, 0, 'begin', -3, twoShots)[0]!.begin, 0);
});

test('a part keeps its coloured frame', () => {
  const parts = [part(10, 5, 15)];
  assert.equal(withEdge(parts, 0, 'end', 3, twoShots)[0]!.end, 10);
  assert.equal(withEdge(parts, 0, 'begin', 18, twoShots)[0]!.begin, 10);
});

test('parts of a shot do not overlap, parts of two shots do not care', () => {
  const parts = [part(3, 1, 5), part(12, 10, 14), part(25, 20, 30)];
  assert.equal(withEdge(parts, 0, 'end', 12, twoShots)[0]!.end, 9);
  assert.equal(withEdge(parts, 1, 'begin', 0, twoShots)[1]!.begin, 6);
  assert.equal(withEdge(parts, 2, 'begin', 0, twoShots)[2]!.begin, 20);
  assert.ok(partsFit(parts, twoShots));
  assert.ok(!partsFit([part(3, 1, 5), part(5, 4, 8)], twoShots));
  assert.ok(!partsFit([part(3, 4, 8)], twoShots), 'its frame is outside');
});

test('parts of one span move together', () => {
  const moved = withEdge([part(3, 1, 8), part(6, 1, 8)], 0, 'end', 4, twoShots);
  assert.deepEqual(moved.map(({ end }) => end), [6, 6], 'not across the other frame');
  assert.ok(partsFit(moved, twoShots));
});

test('a new part is a second to either side, or what is free', () => {
  assert.deepEqual(newSpan(35, [], twoShots), { begin: 25, end: 45 });
  assert.deepEqual(newSpan(21, [], twoShots), { begin: 20, end: 31 });
  assert.deepEqual(newSpan(30, [part(25, 22, 27)], twoShots), { begin: 28, end: 40 });
  assert.deepEqual(newSpan(26, [part(25, 22, 27)], twoShots), { begin: 22, end: 27 }, 'that of the part there');
});

test('the nearest coloured frame of the shot colours a frame', () => {
  assert.equal(keyOf(12, [2, 11, 25], twoShots), 1);
  assert.equal(keyOf(22, [2, 11, 25], twoShots), 2);
  assert.equal(keyOf(22, [2, 11], twoShots), -1);
});

test('marks stand apart', () => {
  assert.equal(markStep(60, 600, 64), 10);
  assert.equal(markStep(2, 600, 64), 0.5);
  for (const seconds of [0.3, 7, 90, 4000]) assert.ok(markStep(seconds, 500, 60) * 500 / seconds >= 60);
});

test('clocks read as people write them', () => {
  assert.equal(clockOf(0), '0:00.00');
  assert.equal(clockOf(62.4), '1:02.40');
  assert.equal(clockOf(59.999), '1:00.00');
  assert.equal(clockOf(5, false), '0:05');
  assert.equal(clockOf(0.5, false), '0:00.5');
});
