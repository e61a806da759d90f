// Corrects a finished scene in headless Chromium by mouse and keyboard, and tells what was seen, as JSON on stdout.
//   node use_corrector.mjs CHROMIUM ADDRESS [SCREENSHOTS]
// ADDRESS: of the page of the run, as `color3d studio OUT` printed it. errors: of the console; requests: beyond the
// studio; wide: states that are wider than a screen of 360 px; faint: texts with a contrast below 4.5; seconds: from a
// stroke to its heat map, from `Apply` to the colours in the photos and in the scene; frames: ms between frames while
// the saturation moves. With a third argument every state leaves PNGs there: light, dark and narrow.
import { pause } from '../../../../../tests/support/browser.mjs';
import { drawnBySoftware, openPage } from '../../../../../tests/support/page_hand.mjs';
import { data, draw, main, setColor, slide } from './corrector_hand.mjs';

const [chromium, address, screenshots] = process.argv.slice(2);
const hand = openPage(chromium, address, screenshots, {
  flags: [...drawnBySoftware, '--window-size=1440,1000'], limit: 120000, every: 25, narrowHeight: 1600,
});
const { send, evaluate, waitFor, boxOf, clickAt, click, press, tell } = hand;
const seen = { seconds: {}, frames: {}, colors: {} };
const look = async (name) => {
  await evaluate('scrollTo(0, 0)');
  await hand.look(name);
};

// Mean colour of a part of the coloured photo, in shares of it.
const colorAt = (x, y) => evaluate(`(() => {
  const canvas = document.querySelector('.co-panes figure:nth-of-type(2) canvas');
  const pixels = canvas.getContext('2d').getImageData(Math.round(${x} * canvas.width) - 2, Math.round(${y} * canvas.height) - 2, 5, 5).data;
  const sum = [0, 0, 0];
  for (let i = 0; i < pixels.length; ++i) if (i % 4 < 3) sum[i % 4] += pixels[i] / 25;
  return sum.map(Math.round);
})()`);
// Place of a patch of the coloured photo that is even, has a weak colour and is neither dark nor bright, in shares of it.
const nearlyGray = `(() => {
  const canvas = document.querySelector('.co-panes figure:nth-of-type(2) canvas');
  const { width, height } = canvas;
  const pixels = canvas.getContext('2d').getImageData(0, 0, width, height).data;
  let best = Infinity, place = [0.5, 0.5];
  for (let y = 12; y < height - 12; y += 4) for (let x = 12; x < width - 12; x += 4) {
    const low = [255, 255, 255], high = [0, 0, 0];
    for (let dy = -8; dy <= 8; dy += 4) for (let dx = -8; dx <= 8; dx += 4) for (let c = 0; c < 3; ++c) {
      const value = pixels[4 * ((y + dy) * width + x + dx) + c];
      low[c] = Math.min(low[c], value);
      high[c] = Math.max(high[c], value);
    }
    const uneven = Math.max(...high.map((value, c) => value - low[c]));
    const mean = high.map((value, c) => (value + low[c]) / 2);
    const weak = Math.max(...mean) - Math.min(...mean);
    if (Math.min(...mean) < 70 || Math.max(...mean) > 200 || weak < 12) continue;
    const cost = 2 * uneven + weak;
    if (cost < best) { best = cost; place = [x / width, y / height]; }
  }
  return place;
})()`;
const seconds = (since) => (Date.now() - since) / 1000;
const tried = async () => {
  const begun = Date.now();
  await waitFor(data('trial'));
  return seconds(begun);
};
// Applies the stroke. Returns seconds to the colours in all photos, and to those in the scene.
const apply = async () => {
  const scene = await evaluate(data('scene'));
  const run = await evaluate(data('run'));
  await click('#co-apply');
  const begun = Date.now();
  await waitFor(data('working'));
  const photos = seconds(begun);
  await waitFor(`${data('run')} !== ${JSON.stringify(run)}`);
  const solved = seconds(begun);
  await waitFor(`${data('scene')} !== ${JSON.stringify(scene)}`);
  return { photos, solved, scene: seconds(begun) };
};
const use = async () => {
  await waitFor('!!document.querySelector("#corrector")');
  await waitFor(data('scene'), 180000);
  await waitFor(data('shown'));
  await look('start');
  await click('[data-name=source]');
  await pause(800);
  await look('where_from');
  await click('[data-name=color]');

  // A stroke by mouse.
  await setColor(hand, '#c81e1e');
  seen.colors.before = await colorAt(0.5, 0.7);
  await draw(hand, [0.45, 0.7], [0.55, 0.7]);
  seen.seconds.tried = await tried();
  await pause(800);
  await look('touches');
  seen.touches = await evaluate('document.querySelector(".co-draft p").textContent');
  // Its reach by keyboard.
  const first = await evaluate(data('trial'));
  await evaluate('document.querySelector("#co-reach").focus()');
  for (let i = 0; i < 12; ++i) await press('ArrowLeft');
  await waitFor(`${data('trial')} && ${data('trial')} !== ${JSON.stringify(first)}`);
  await pause(600);
  seen.touches_less = await evaluate('document.querySelector(".co-draft p").textContent');
  seen.seconds.apply = await apply();
  await waitFor(`${data('corrections')} === '1'`);
  await pause(1500);
  seen.colors.after = await colorAt(0.5, 0.7);
  await look('applied');

  // Another page on the same scene.
  const { targetId } = await send('Target.createTarget', { url: await evaluate('location.href') }, null);
  const { sessionId } = await send('Target.attachToTarget', { targetId, flatten: true }, null);
  const other = async (expression) => {
    const answer = await send('Runtime.evaluate', { expression, awaitPromise: true, returnByValue: true }, sessionId);
    if (answer.exceptionDetails) throw new Error(answer.exceptionDetails.exception.description);
    return answer.result.value;
  };
  const theirs = (name) => `(document.querySelector('#corrector')?.dataset.${name} ?? '')`;
  await waitFor(`${theirs('corrections')} === '1'`, 60000, { read: other });

  // A second stroke on another photo, by keyboard.
  const { targetInfo } = await send('Target.getTargetInfo', {});
  await send('Target.activateTarget', { targetId: targetInfo.targetId }, null);
  await click('.co-strip li:nth-child(2) button');
  await waitFor(`document.querySelector('.co-strip li:nth-child(2) button').getAttribute('aria-pressed') === 'true'`);
  await pause(500);
  await setColor(hand, '#2b5fc4');
  await evaluate(`document.querySelector(${JSON.stringify(main)}).focus()`);
  for (let i = 0; i < 3; ++i) await press('ArrowUp');
  await press('Enter');
  seen.seconds.tried_again = await tried();
  seen.seconds.apply_again = await apply();
  await waitFor(`${data('corrections')} === '2'`);
  await waitFor(`${theirs('corrections')} === '2'`, 30000, { read: other });
  seen.other_page_followed = true;

  // The first one is looked at without, and removed.
  await click('.co-history li:first-child button');
  await waitFor(data('without'));
  await pause(1500);
  await look('without');
  await click('.co-history li:first-child .co-remove');
  await waitFor(`${data('corrections')} === '1'`);
  seen.left_over = await evaluate('document.querySelector(".co-history .co-what span").textContent');
  await waitFor(`${theirs('corrections')} === '1'`, 30000, { read: other });
  await send('Target.closeTarget', { targetId }, null);
  await waitFor(`!(${data('working')})`);

  // Saturation by mouse; the scene follows when it is let go of.
  const run = await evaluate(data('run'));
  seen.colors.tone_before = await colorAt(0.3, 0.3);
  seen.frames = await slide(hand, '#co-saturation', 0.5, 0.95);
  seen.colors.tone_after = await colorAt(0.3, 0.3);
  const begun = Date.now();
  await waitFor(`${data('run')} !== ${JSON.stringify(run)}`);
  seen.seconds.tone = seconds(begun);
  await waitFor(`!${data('working')}`);
  // White balance: something that is nearly grey becomes grey.
  await click('#co-reset-tone');
  await waitFor(data('working'));
  await waitFor(`!${data('working')}`);
  const [u, v] = await evaluate(nearlyGray);
  seen.colors.gray_before = await colorAt(u, v);
  await click('#co-gray');
  const { x, y, width, height } = await boxOf(main);
  await clickAt(x + u * width, y + v * height);
  await pause(500);
  seen.colors.gray = await colorAt(u, v);
  await waitFor(data('working'));
  await waitFor(`!(${data('working')})`);
  await look('gray');

  // A click in the scene.
  await waitFor(`${data('scene')}.length > 0`);
  await click('[data-name=color]');
  const scene = await boxOf('.co-scene');
  await pause(1500);
  await clickAt(scene.x + 0.5 * scene.width, scene.y + 0.4 * scene.height);
  await tried();
  seen.scene_click = true;
  await click('#co-discard');
  return seen;
};

await tell(use);
