import assert from 'node:assert/strict';
import test from 'node:test';

import { gainBetween, gainOf, neutralized, plainGain, plainTone, toned, type Tone } from './tone';

const near = (x: number, y: number, slack = 1e-9): void => assert.ok(Math.abs(x - y) <= slack, `${x} is not ${y}`);
const colors = [{ l: 20, a: 10, b: -30 }, { l: 75, a: -22, b: 41 }, { l: 50, a: 0, b: 0 }];
const tones: Tone[] = [plainTone, { saturation: 1.6, tint: -12, warmth: 20 }, { saturation: 0.4, tint: 30, warmth: -8 }];

test('a tone without a change keeps colours', () => {
  assert.deepEqual(gainOf(plainTone), plainGain);
});

test('tint and warmth are a and b of a grey of L 50', () => {
  const gray = toned({ l: 50, a: 0, b: 0 }, gainOf({ saturation: 1.3, tint: 7, warmth: -11 }));
  near(gray.a, 7);
  near(gray.b, -11);
});

test('the gain between two tones leads from one to the other', () => {
  for (const before of tones) {
    for (const after of tones) {
      for (const color of colors) {
        const by = toned(toned(color, gainOf(before)), gainBetween(before, after));
        const at = toned(color, gainOf(after));
        near(by.a, at.a, 1e-6);
        near(by.b, at.b, 1e-6);
      }
    }
  }
});

test('a scene without saturation takes the white balance alone', () => {
  const [ka, pa] = gainBetween({ ...plainTone, saturation: 0 }, { saturation: 2, tint: 6.6, warmth: 0 });
  near(ka, 0);
  near(pa, 0.1);
});

test('the colour that is said to be grey becomes grey', () => {
  for (const saturation of [0.5, 1, 1.7]) {
    for (const color of [{ l: 60, a: 6, b: 18 }, { l: 35, a: -9, b: -14 }, { l: 80, a: 0, b: 3 }]) {
      const gray = toned(color, gainOf(neutralized(color, { saturation, tint: 0, warmth: 0 })));
      near(gray.a, 0, 1e-6);
      near(gray.b, 0, 1e-6);
    }
  }
});

test('the white balance stays within what the service takes', () => {
  const { tint, warmth } = neutralized({ l: 2, a: 90, b: -100 }, plainTone);
  assert.ok(Math.abs(tint) <= 50 && Math.abs(warmth) <= 50);
});
