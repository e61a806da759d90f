// Measures how long a correction takes in the studio, with a real mouse in headless Chromium:
//   node measure_correction.mjs CHROMIUM ADDRESS [STROKES] [SCREENSHOTS]
// ADDRESS: of the page of a finished run, as `color3d studio OUT --no-open` printed it. Prints as JSON: tried: s from the
// end of a stroke to the map of what it touches; scene: s from there to its colours in the scene; frames: ms between
// frames while the saturation is moved.
import { pause } from '../../../../../tests/support/browser.mjs';
import { drawnBySoftware, openPage } from '../../../../../tests/support/page_hand.mjs';

const [chromium, address, count = '5', screenshots] = process.argv.slice(2);
const hand = openPage(chromium, address, screenshots, {
  flags: [...drawnBySoftware, '--window-size=1440,1000'], limit: 120000, every: 10,
});
const { evaluate, waitFor, boxOf, mouse, click, drag, keep, tell } = hand;
const data = (name) => `(document.querySelector('#corrector').dataset[${JSON.stringify(name)}] ?? '')`;
const main = '.co-panes figure:nth-of-type(2) canvas:last-child';
const median = (values) => [...values].sort((a, b) => a - b)[values.length >> 1];

const strokes = async () => {
  const times = { tried: [], scene: [], all: [] };
  for (let i = 0; i < Number(count); ++i) {
    const { x, y, width, height } = await boxOf(main);
    const at = [0.15 + 0.7 * ((i * 0.618) % 1), 0.2 + (0.6 * (i % 5)) / 5];
    // A new colour each time: what was tried before comes from the cache.
    const color = '#' + Math.floor(Math.random() * 0x1000000).toString(16).padStart(6, '0');
    await evaluate(`(() => {
      const input = document.querySelector('#co-color');
      input.value = ${JSON.stringify(color)};
      input.dispatchEvent(new Event('input'));
    })()`);
    const before = await evaluate(data('recolored'));
    await drag([x + at[0] * width, y + at[1] * height], [x + (at[0] + 0.08) * width, y + at[1] * height]);
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

// ms between frames while a slider is moved by the mouse.
const slide = async (selector, from, to) => {
  const { x, y, width, height } = await boxOf(selector);
  await evaluate(`(() => {
    window.color3dFrames = [];
    const tick = (now) => { window.color3dFrames.push(now); window.color3dTick = requestAnimationFrame(tick); };
    requestAnimationFrame(tick);
  })()`);
  await mouse('mousePressed', x + from * width, y + height / 2);
  for (let i = 1; i <= 30; ++i) await mouse('mouseMoved', x + (from + ((to - from) * i) / 30) * width, y + height / 2);
  const frames = await evaluate('cancelAnimationFrame(window.color3dTick), window.color3dFrames.slice(1).map((t, i) => t - window.color3dFrames[i])');
  await keep('saturation');
  await mouse('mouseReleased', x + to * width, y + height / 2);
  return { median: median(frames), longest: Math.max(...frames), count: frames.length };
};

await tell(async () => {
  await waitFor('!!document.querySelector("#corrector")');
  await waitFor(data('scene'), 180000);
  await waitFor(data('shown'));
  await pause(2000);
  const seen = await strokes();
  await pause(1000);
  seen.frames = await slide('#co-saturation', 0.5, 0.95);
  return seen;
});
