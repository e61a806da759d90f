// Opens a page of core/view in headless Chromium and tells what is to be seen, as JSON on stdout.
//   node look_at_page.mjs CHROMIUM PAGE [SCREENSHOTS]
// state: data-state of the page; note: its text; errors: of the console; requests: other than for
// what is inside of the page; seen: for each step the mean colours (0..255) of the stage's left and
// right part; movie: seconds that the movie of the page has played, and its width. With a third argument every step leaves a PNG there.
import { mkdirSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';

import { openBrowser, pause } from '../../tests/support/browser.mjs';

const [chromium, page, screenshots] = process.argv.slice(2);
if (screenshots) mkdirSync(screenshots, { recursive: true });
const flags = [
  '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist', '--window-size=640,560',
  ...(process.env.COLOR3D_BROWSER_FLAGS ?? '').split(' ').filter(Boolean),
];
const { send, open, evaluate, close, errors, requests } =
    openBrowser(chromium, flags, (type) => ['error', 'warning', 'assert'].includes(type));

// Mean colours of the stage's left and right part, away from the middle and from the texts.
const measure = `async (png) => {
  const image = new Image();
  image.src = 'data:image/png;base64,' + png;
  await image.decode();
  const canvas = document.createElement('canvas');
  canvas.width = image.width;
  canvas.height = image.height;
  const context = canvas.getContext('2d');
  context.drawImage(image, 0, 0);
  const stage = document.getElementById('stage');
  const mean = (left) => {
    const part = context.getImageData(Math.round(left * stage.clientWidth),
        Math.round(0.4 * stage.clientHeight), 40, 40).data;
    const sum = [0, 0, 0];
    for (let i = 0; i < part.length; ++i) if (i % 4 < 3) sum[i % 4] += part[i] / 1600;
    return sum.map(Math.round);
  };
  return { left: mean(0.3), right: mean(0.63) };
}`;

const look = async () => {
  await open();
  await send('Page.navigate', { url: 'file://' + resolve(page) });
  const began = Date.now();
  const state = () => evaluate('document.body?.dataset.state ?? "loading"');
  while (await state() === 'loading' && Date.now() - began < 60000) await pause(200);
  const result = { state: await state(), seconds: (Date.now() - began) / 1000, errors, requests };
  result.note = await evaluate('document.getElementById("note").textContent');
  const movie = 'document.getElementById("movie")';
  if (await evaluate(`!${movie}.hidden`)) {
    await pause(1500);
    result.movie = await evaluate(`({ seconds: ${movie}.currentTime, width: ${movie}.videoWidth })`);
  }
  const steps = {
    color: '', gray: '[data-shades="1"]', where_from: '[data-shades="2"]',
    back_in_color: '[data-shades="0"]', photo: '#compare',
  };
  if (await evaluate('!document.getElementById("see-movie").hidden')) steps.film = '#see-movie';
  result.seen = {};
  for (const [name, button] of Object.entries(steps)) {
    if (button) await evaluate(`document.querySelector('${button}').click()`);
    if (button === '#compare') {
      await evaluate('(() => { const s = document.getElementById("share"); s.value = 100; s.dispatchEvent(new Event("input")); })()');
    }
    await pause(2500);
    const { data } = await send('Page.captureScreenshot', { format: 'png' });
    if (screenshots) writeFileSync(join(screenshots, name + '.png'), Buffer.from(data, 'base64'));
    result.seen[name] = await evaluate(`(${measure})("${data}")`);
  }
  return result;
};

let failed = 0;
try {
  console.log(JSON.stringify(await look(), null, 1));
} catch (error) {
  console.error(error.stack);
  failed = 1;
}
await close();
process.exit(failed);
