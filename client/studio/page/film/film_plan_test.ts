import assert from 'node:assert/strict';
import test from 'node:test';

import { FilmPlan } from './film_plan';
import { evenTimes, type FilmTimes } from './timeline_model';

const film: FilmTimes = {
  names: Array.from({ length: 30 }, (_, i) => `f${i}.png`), times: evenTimes(30, 10), shots: new Array(30).fill(0),
};
const fresh = (): FilmPlan => new FilmPlan(film, { keys: [{ frame: 4, way: 'automatic' }], parts: [] }, () => undefined);

test('a job is read as it was sent', () => {
  const job = {
    names: [...film.names], times: [...film.times], shots: [...film.shots], coverage: [], next: null, poses: false,
    keys: [{ view: 'f4', automatic: true, begin_s: null, end_s: null }],
    parts: [{ view: 'f12.png', automatic: false, begin_s: 1, end_s: 1.5 }, { view: 'f2', automatic: true, begin_s: null, end_s: 0.35 }],
  };
  const plan = FilmPlan.ofJob(film, job, () => undefined);
  assert.deepEqual(plan.parts.map(({ frame, begin, end }) => [frame, begin, end]), [[12, 10, 15], [2, 0, 3]]);
  assert.ok(!plan.isChanged());
  assert.deepEqual(plan.toBody(), {
    keys: [{ kept: 0 }], parts: [{ kept: 0, begin_s: 1, end_s: 1.5 }, { kept: 1, begin_s: 0, end_s: film.times[3] }],
  });
});

test('what is sent has the colours of each frame', () => {
  const plan = fresh();
  const strokes = [{ x: 1, y: 2, radius: 2, color: '#aa0000' }];
  plan.color('parts', plan.addPart(20), { way: 'strokes', strokes });
  plan.color('keys', plan.addKey(9), { way: 'picture', picture: 'p.png' });
  const { keys, parts } = plan.toBody();
  assert.deepEqual(keys, [{ view: 'f4.png', color: 'automatic' }, { view: 'f9.png', color: 'picture', picture: 'p.png' }]);
  assert.equal(parts[0]!.view, 'f20.png');
  assert.deepEqual(JSON.parse(parts[0]!.strokes!), strokes);
  assert.ok(parts[0]!.begin_s! < 2 && parts[0]!.end_s! > 2);
});

test('a frame is coloured once', () => {
  const plan = fresh();
  assert.equal(plan.addKey(4), 0);
  assert.equal(plan.keys.length, 1);
  assert.equal(plan.addKey(5), 1);
});

test('the last coloured frame stays', () => {
  const plan = fresh();
  plan.remove('keys', 0);
  assert.equal(plan.keys.length, 1);
});

test('undo takes back a whole drag', () => {
  const plan = fresh();
  plan.addPart(15);
  const { end } = plan.parts[0]!;
  let joins = false;
  for (const frame of [end, 24, 22, 18]) joins = plan.moveEdge(0, 'end', frame, joins) || joins;
  assert.equal(plan.parts[0]!.end, 18);
  plan.undo();
  assert.equal(plan.parts[0]!.end, end);
  plan.redo();
  assert.equal(plan.parts[0]!.end, 18);
  plan.undo();
  plan.undo();
  assert.equal(plan.parts.length, 0);
  assert.ok(!plan.canUndo);
  assert.ok(!plan.isChanged());
});

test('what was coloured before is coloured anew when it changes', () => {
  const plan = FilmPlan.ofJob(film, {
    names: [], times: [], shots: [], coverage: [], next: null, poses: false, parts: [],
    keys: [{ view: 'f4.png', automatic: false, begin_s: null, end_s: null }],
  }, () => undefined);
  plan.color('keys', 0, { way: 'automatic' });
  assert.deepEqual(plan.toBody().keys, [{ view: 'f4.png', color: 'automatic' }]);
  assert.ok(plan.isChanged());
});

test('nothing is sent before it is painted', () => {
  const plan = fresh();
  assert.equal(plan.missing(), '');
  plan.color('keys', 0, { way: 'strokes' });
  assert.match(plan.missing(), /Paint/);
  plan.color('keys', 0, { way: 'picture' });
  assert.match(plan.missing(), /picture/);
});
