// Measures how long a correction takes in the studio, with a real mouse in headless Chromium:
//   node measure_correction.mjs CHROMIUM ADDRESS [STROKES] [SCREENSHOTS]
// ADDRESS: of the page of a finished run, as `color3d studio OUT --no-open` printed it. Prints as JSON: tried: s from the
// end of a stroke to the map of what it touches; scene: s from there to its colours in the scene; frames: ms between
// frames while the saturation is moved.
import { pause } from '../../../../../tests/support/browser.mjs';
import { drawnBySoftware, openPage } from '../../../../../tests/support/page_hand.mjs';
import { data, draw, setColor, slide } from './corrector_hand.mjs';

const [chromium, address, count = '5', screenshots] = process.argv.slice(2);
const hand = openPage(chromium, address, screenshots, {
  flags: [...drawnBySoftware, '--window-size=1440,1000'], limit: 120000, every: 10,
});
const { evaluate, waitFor, click, keep, tell } = hand;
const median = (values) => [...values].sort((a, b) => a - b)[values.length >> 1];

const strokes = async () => {
  const times = { tried: [], scene: [], all: [] };
  for (let i = 0; i < Number(count); ++i) {
    const at = [0.15 + 0.7 * ((i * 0.618) % 1), 0.2 + (0.6 * (i % 5)) / 5];
    // A new colour each time: what was tried before comes from the cache.
    const color = '#' + Math.floor(Math.random() * 0x1000000).toString(16).padStart(6, '0');
    await setColor(hand, color);
    const before = await evaluate(data('recolored'));
    await draw(hand, at, [at[0] + 0.08, at[1]]);
    const begun = Date.now();
    await waitFor(data('trial'));
    const tried = Date.now();
    await waitFor(`${data('recolored')} !== ${JSON.stringify(before)}`);
    const end = Date.now();
    times.tried.push((tried - begun) / 1000);
    times.scene.push((end - tried) / 1000);
    times.all.push((end - begun) / 1000);
    if (i === 0) {
      await pause(1500);
      await keep('stroke');
    }
    const shown = await evaluate(data('recolored'));
    await click('#co-discard');
    await waitFor(`!${data('trial')} && ${data('recolored')} !== ${JSON.stringify(shown)}`);
  }
  return { tried: median(times.tried), scene: median(times.scene), all: median(times.all), times };
};

await tell(async () => {
  await waitFor('!!document.querySelector("#corrector")');
  await waitFor(data('scene'), 180000);
  await waitFor(data('shown'));
  await pause(2000);
  const seen = await strokes();
  await pause(1000);
  seen.frames = await slide(hand, '#co-saturation', 0.5, 0.95);
  return seen;
});
