import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import test from 'node:test';

import { checkInside, checkStrokes, parseStrokes, serializeStrokes, StrokeFileError } from './stroke_file';

const fixture = (name: string): string => readFileSync(`${process.env.PAINT_FIXTURES}/${name}`, 'utf8');

test('strokes that the command line takes are written as the same bytes', () => {
  const text = fixture('strokes.json');
  assert.equal(serializeStrokes(parseStrokes(text)), text);
});

test('equal strokes are equal bytes, however they were written', () => {
  const written = '[{"color":"#A0522D","y":80.50,"x":1.2e2},\n\n{"keep":"auto","line":[[1,2],[3.0,4]]}]';
  assert.equal(serializeStrokes(parseStrokes(written)),
    '[\n{"x": 120, "y": 80.5, "radius": 2, "color": "#a0522d"},\n' +
    '{"line": [[1, 2], [3, 4]], "width": 4, "keep": "auto"}\n]\n');
  assert.equal(serializeStrokes([]), '[]\n');
  assert.equal(serializeStrokes(parseStrokes('[{"color":"#00FF00","label":3}]')),
    '[\n{"label": 3, "color": "#00ff00"}\n]\n');
});

// The cases of core/keycolor/hints/hints_json_test.cc, but for the empty list, which is a painting not yet begun.
test('what the service refuses is refused', () => {
  const bad = [
    '', '{', '{}', '[1]', 'null', '[{"x":1,"y":1}]', '[{"x":1,"color":"#000000"}]',
    '[{"x":"1","y":1,"color":"#000000"}]', '[{"x":1,"y":1,"color":"red"}]', '[{"x":1,"y":1,"color":"#00000g"}]',
    '[{"x":1,"y":1,"color":7}]', '[{"x":-1,"y":1,"color":"#000000"}]', '[{"x":1,"y":1,"radius":-2,"color":"#000000"}]',
    '[{"x":1,"y":1,"colour":"#000000","color":"#000000"}]', '[{"line":[],"color":"#000000"}]',
    '[{"line":[[1,2,3]],"color":"#000000"}]', '[{"line":[[1,2]],"radius":3,"color":"#000000"}]',
    '[{"line":[[1,2]],"width":-1,"color":"#000000"}]', '[{"region":"all","color":"#000000"}]',
    '[{"region":[[0,0],[1,"a"],[1,1]],"color":"#000000"}]', '[{"label":256,"color":"#000000"}]',
    '[{"label":1.5,"color":"#000000"}]', '[{"label":1,"x":1,"color":"#000000"}]', '[{"label":1}]',
    '[{"label":1,"keep":"red"}]', '[{"label":1,"keep":"auto","color":"#000000"}]',
  ];
  for (const text of bad) assert.throws(() => parseStrokes(text), StrokeFileError, text);
});

test('a message names the entry', () => {
  assert.throws(() => parseStrokes('[{"x":1,"y":1,"color":"#000000"},{"x":1,"y":1,"color":"blue"}]'), /colour hint 1/);
});

test('strokes outside of the photo are refused by name', () => {
  const at = (entry: object) => () => checkInside(checkStrokes([entry]), 100, 50);
  at({ line: [[0, 0], [100, 50]], color: '#000000' })();
  assert.throws(at({ x: 100, y: 1, color: '#000000' }), /colour hint 0 at \(100, 1\) lies outside the photo of 100x50/);
  assert.throws(at({ line: [[0, 0], [101, 50]], color: '#000000' }), /lies outside/);
  assert.throws(at({ region: [[0, 0], [10, 5]], color: '#000000' }), /at least 3/);
});
