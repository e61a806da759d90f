// Goes the whole way with a scene in headless Chromium, by mouse and keyboard or by touch, and measures how long it takes:
// a folder is dropped, three strokes are drawn on the key photo above automatic colours, the scene is coloured, a stroke
// corrects it, the correction is undone, the page of the scene is saved.
//   node walk_scene.mjs CHROMIUM ADDRESS FOLDER OUT mouse|touch [SCREENSHOTS]
// ADDRESS: as `color3d studio` printed it; OUT: receives what is saved. Prints as JSON: seconds: since the drop, at the
// end of each step; saved: bytes of the page; errors, requests, wide, faint as in page_hand.mjs.
import { readdirSync, statSync } from 'node:fs';
import { join } from 'node:path';

import { drawnBySoftware, openPage } from '../../tests/support/page_hand.mjs';
import { data, draw, main } from './page/correct/check/corrector_hand.mjs';

const [chromium, address, folder, out, how, screenshots] = process.argv.slice(2);
const byTouch = how === 'touch';
const hand = openPage(chromium, address, screenshots, {
  byTouch, flags: [...drawnBySoftware, '--window-size=1440,1000'], limit: 240000,
});
const { send, evaluate, waitFor, boxOf, click, drag, press, drop, choose, saveTo, savedAs, clickText, keep, tell } = hand;

// A stroke on the key photo between two places, shares of it; the canvas has edges around it.
const paint = async (from, to) => {
  const { x, y, width, height } = await boxOf('.paint-stage canvas');
  const edge = await evaluate('(({ x, y }) => ({ x: Number(x), y: Number(y) }))(document.querySelector(".paint").dataset)');
  const at = ([u, v]) => [x + edge.x + u * (width - 2 * edge.x), y + edge.y + v * (height - 2 * edge.y)];
  await drag(at(from), at(to));
};
const setCode = async (hex) => {
  await click('.paint-code input');
  await evaluate('document.activeElement.select()');
  await send('Input.insertText', { text: hex });
  await press('Enter');
};

await tell(async () => {
  await saveTo(out);
  await waitFor('!!document.querySelector(".drop-area")');
  const seconds = {};
  const begun = Date.now();
  const done = async (step) => {
    seconds[step] = (Date.now() - begun) / 1000;
    await keep(step);
  };

  // A finger drops nothing: it chooses the folder in the dialog of the system.
  if (byTouch) await choose('#choose-folder', folder);
  else await drop('.drop-area', folder);
  await waitFor('location.hash.startsWith("#set/") && !!document.querySelector("#go-on")');
  await done('photos');
  await click('#go-on');
  await waitFor('!!document.querySelector("#start") && document.querySelector("#key-photo")?.complete');
  await click('input[value=automatic]');
  await waitFor('document.querySelector("#told").textContent === "" && document.querySelector("#key-photo").src.startsWith("blob:")');
  await done('key');

  await click('#paint');
  await waitFor('!!document.querySelector(".paint-stage canvas")');
  const strokes = [['#d8b020', [0.40, 0.51], [0.55, 0.60]], ['#b8a890', [0.10, 0.12], [0.26, 0.16]], ['#b8a890', [0.70, 0.86], [0.88, 0.88]]];
  for (const [i, [color, from, to]] of strokes.entries()) {
    await setCode(color);
    await paint(from, to);
    await waitFor(`document.querySelector(".paint").dataset.count === "${i + 1}" && document.querySelector(".paint").dataset.preview === "shown"`);
  }
  await done('painted');

  await click('#start');
  await waitFor('document.querySelectorAll(".gallery img").length > 1'); // the key photo and another one
  await done('first_colors');
  await waitFor('document.querySelector("main").dataset.state === "done"');
  await waitFor(data('scene'));
  await waitFor(data('shown'));
  await done('scene');

  await draw(hand, [0.45, 0.70], [0.55, 0.72]);
  await waitFor(data('trial'));
  await done('touches');
  const run = await evaluate(data('run'));
  await click('#co-apply');
  await waitFor(`${data('run')} !== ${JSON.stringify(run)} && ${data('corrections')} === '1'`);
  await done('corrected');

  const corrected = await evaluate(data('run'));
  if (byTouch) {
    await click('.co-history li:first-child .co-remove');
  } else {
    await evaluate(`document.querySelector(${JSON.stringify(main)}).focus()`);
    await press('z', 2);
  }
  await waitFor(`${data('run')} !== ${JSON.stringify(corrected)} && ${data('corrections')} === '0'`);
  await done('undone');

  await waitFor(`!${data('working')}`);
  await clickText('Save the page');
  await savedAs('view.html');
  await done('saved');
  return { seconds, saved: Object.fromEntries(readdirSync(out).map((name) => [name, statSync(join(out, name)).size])) };
});
