// Measures how long the preview of a stroke takes in the studio, with a real mouse in headless Chromium:
//   node measure_preview.mjs CHROMIUM ADDRESS [STROKES] [SCREENSHOTS]
// ADDRESS: as `color3d studio PHOTOS --no-open` printed it. Prints a line for each choice of colours below the strokes: the
// median, 90th percentile and maximum of the times, ms, from the end of the stroke to the picture in the page.
import { mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';

import { openBrowser, pause } from '../../tests/support/browser.mjs';

const [chromium, address, count = '20', screenshots] = process.argv.slice(2);
if (screenshots) mkdirSync(screenshots, { recursive: true });
const { send, open, evaluate, close } = openBrowser(chromium, ['--window-size=1400,1000', '--force-color-profile=srgb']);

const waitFor = async (expression, limit = 120000) => {
  for (const end = Date.now() + limit; Date.now() < end; await pause(10)) {
    const value = await evaluate(expression);
    if (value) return value;
    const problem = await evaluate('document.querySelector(".problem p")?.textContent');
    if (problem) throw new Error('the page says: ' + problem);
  }
  throw new Error(`waited in vain for ${expression}`);
};
const click = (selector) => evaluate(`document.querySelector(${JSON.stringify(selector)}).click()`);
const mouse = (type, [x, y], more = {}) => send('Input.dispatchMouseEvent', { type, x, y, ...more });

// A stroke between two places, shares of the canvas that shows the photo.
const stroke = async (from, to) => {
  const box = await evaluate(`(() => { const c = document.querySelector('.paint-stage canvas');
    c.scrollIntoView({ block: 'center' });
    const b = c.getBoundingClientRect(), d = document.querySelector('.paint').dataset;
    return { left: b.x + Number(d.x), top: b.y + Number(d.y), width: b.width - 2 * d.x, height: b.height - 2 * d.y }; })()`);
  const at = ([x, y]) => [Math.round(box.left + x * box.width), Math.round(box.top + y * box.height)];
  await mouse('mousePressed', at(from), { button: 'left', buttons: 1, clickCount: 1 });
  for (let i = 1; i <= 6; ++i) {
    await mouse('mouseMoved', at([0, 1].map((k) => from[k] + ((to[k] - from[k]) * i) / 6)), { button: 'left', buttons: 1 });
  }
  await mouse('mouseReleased', at(to), { button: 'left', clickCount: 1 });
};

const measure = async (below) => {
  await evaluate(`document.querySelector('input[value=${below}]').click()`);
  if (below !== 'nothing') await waitFor('document.querySelector("#told").textContent === ""');
  await pause(500);
  const times = [];
  for (let i = 0; i <= Number(count); ++i) { // the first one starts the service's worker
    const y = 0.06 + (0.88 * ((i * 7) % 21)) / 21, x = 0.1 + 0.7 * ((i * 0.618) % 1);
    await evaluate('delete document.querySelector(".paint").dataset.previewMs');
    await stroke([x, y], [x + 0.06, y + 0.03]);
    await waitFor('document.querySelector(".paint").dataset.previewMs && document.querySelector(".paint").dataset.preview === "shown"');
    const ms = Number(await evaluate('document.querySelector(".paint").dataset.previewMs'));
    if (i > 0) times.push(ms);
    await pause(60);
    if (screenshots && [0, 3, Number(count)].includes(i)) {
      const { data } = await send('Page.captureScreenshot', { format: 'png' });
      writeFileSync(join(screenshots, `${below}_${i}.png`), Buffer.from(data, 'base64'));
    }
  }
  times.sort((a, b) => a - b);
  const at = (share) => times[Math.min(times.length - 1, Math.floor(share * times.length))];
  console.log(`${below}: median of ${times.length} ${at(0.5)} ms, 90 % ${at(0.9)} ms, longest ${times.at(-1)} ms`);
};

let failed = 0;
try {
  await open();
  await send('Page.navigate', { url: address });
  const set = /page=set\/([0-9a-f-]+)/.exec(address)[1];
  await waitFor('location.hash.startsWith("#set/")');
  await evaluate(`location.hash = 'key/${set}'`);
  await waitFor('!!document.querySelector("#paint")', 600000);
  await waitFor('document.querySelector("#told").textContent === ""');
  await click('#paint');
  await waitFor('!!document.querySelector(".paint-stage canvas")');
  for (const below of ['nothing', 'automatic']) await measure(below);
} catch (error) {
  console.error(error.stack);
  failed = 1;
}
await close();
process.exit(failed);
