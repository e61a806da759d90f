import assert from 'node:assert/strict';
import test from 'node:test';

import {
  firstSettings, largestWidth, resistanceOfReach, SettingsStore, sliderOfWidth, widthOfSlider,
} from './settings';

test('the slider of widths goes from one px to the largest, and back', () => {
  for (const longerSide of [100, 1000, 6000]) {
    const largest = largestWidth(longerSide);
    assert.equal(widthOfSlider(0, largest), 1);
    assert.equal(widthOfSlider(100, largest), largest);
    for (let v = 0; v <= 100; v += 5) {
      assert.ok(Math.abs(sliderOfWidth(widthOfSlider(v, largest), largest) - v) <= 8, `${v} of ${largest}`);
    }
  }
});

test('more reach overcomes more', () => {
  for (let reach = 2; reach <= 100; ++reach) assert.ok(resistanceOfReach(reach) > resistanceOfReach(reach - 1));
});

test('listeners hear what was before and what is now', () => {
  const store = new SettingsStore(firstSettings(600));
  const heard: [string, string][] = [];
  store.onChange((now, before) => heard.push([before.tool, now.tool]));
  store.set({ tool: 'line' });
  store.setLayer('preview', { opacity: 0.5 });
  assert.deepEqual(heard, [['brush', 'line'], ['line', 'line']]);
  assert.deepEqual(store.now.layers.preview, { isShown: true, opacity: 0.5 });
});
