// Shows a page of core/view in a frame, in headless Chromium, and has it drawn in tones (page/framed.js). Prints as JSON:
// errors: of the console; seen: mean colours (0..255) of the scene's left and right part, for each tone as soon as it is
// said to be drawn (at_once) and when the scene itself was drawn in it (at_rest), and after the camera has moved; rows:
// then, green of 8 rows of the picture, at_once and at_rest.
//   node show_tones.mjs CHROMIUM PAGE [SCREENSHOTS]
import { mkdirSync, writeFileSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';

import { drawnBySoftware } from '../../tests/support/page_hand.mjs';
import { openBrowser, pause } from '../../tests/support/browser.mjs';

const [chromium, page, screenshots] = process.argv.slice(2);
if (screenshots) mkdirSync(screenshots, { recursive: true });
const around = join(dirname(resolve(page)), 'around.html');
writeFileSync(around, `<!doctype html><body style="margin:0">
<iframe src="${page.split('/').pop()}" sandbox="allow-scripts" style="border:0;width:600px;height:400px"></iframe><script>
const frame = document.querySelector('iframe');
const waiting = {};
const told = (kind) => new Promise((done) => { waiting[kind] = done; });
told('ready').then(() => { window.isReady = true; });
addEventListener('message', ({ data }) => waiting[data.color3d]?.());
window.show = (tone) => {
  const drawn = told('drawn');
  frame.contentWindow.postMessage({ color3d: 'show', bare: true, shades: 0, tone }, '*');
  return drawn;
};
</script>`);
const { send, open, evaluate, close, errors } =
    openBrowser(chromium, [...drawnBySoftware, '--window-size=640,560'], (type) => ['error', 'warning', 'assert'].includes(type));

const colors = async (name) => {
  const { data } = await send('Page.captureScreenshot', { format: 'png' });
  if (screenshots) writeFileSync(join(screenshots, name + '.png'), Buffer.from(data, 'base64'));
  return evaluate(`(async () => {
    const image = new Image();
    image.src = 'data:image/png;base64,${data}';
    await image.decode();
    const canvas = new OffscreenCanvas(image.width, image.height);
    const context = canvas.getContext('2d');
    context.drawImage(image, 0, 0);
    const mean = (x) => {
      const part = context.getImageData(x, 150, 30, 30).data;
      const sum = [0, 0, 0];
      for (let i = 0; i < part.length; ++i) if (i % 4 < 3) sum[i % 4] += part[i] / 900;
      return sum.map(Math.round);
    };
    const rows = [];
    for (let row = 0; row < 8; ++row) {
      const part = context.getImageData(100, 50 * row, 400, 50).data;
      let sum = 0;
      for (let i = 1; i < part.length; i += 4) sum += part[i];
      rows.push(Math.round((4 * sum) / part.length));
    }
    return { left: mean(200), right: mean(370), rows };
  })()`);
};

const tones = { plain: [1, 0, 1, 0], half: [0.5, 0, 0.5, 0], warm: [1, 0, 1, 0.3], gray: [0, 0, 0, 0], again: [1, 0, 1, 0] };
const use = async () => {
  await open();
  await send('Page.navigate', { url: 'file://' + around });
  const isThere = () => evaluate('window.isReady === true').catch(() => false); // while it comes, there is another page
  for (const end = Date.now() + 60000; Date.now() < end && !await isThere();) await pause(200);
  await pause(1500);
  const seen = {};
  for (const [name, tone] of Object.entries(tones)) {
    // A slider passes through other tones before.
    for (const share of [0.3, 0.6]) await evaluate(`window.show(${JSON.stringify(tone.map((k) => share * k))})`);
    await evaluate(`window.show(${JSON.stringify(tone)})`);
    await pause(200);
    seen[name] = { at_once: await colors(name + '_at_once') };
    await pause(2500);
    seen[name].at_rest = await colors(name + '_at_rest');
  }
  await evaluate('window.show([0, 0, 0, 0])');
  const mouse = (type, x, y) => send('Input.dispatchMouseEvent', { type, x, y, button: 'left', buttons: type === 'mouseReleased' ? 0 : 1, clickCount: 1 });
  await mouse('mousePressed', 300, 200);
  for (let i = 1; i <= 8; ++i) await mouse('mouseMoved', 300 + 4 * i, 200 + 12 * i);
  await mouse('mouseReleased', 332, 296);
  await pause(2500);
  seen.moved = await colors('moved');
  for (const tone of [[0.8, 0, 0.8, 0], [1.2, 0, 1.2, 0]]) await evaluate(`window.show(${JSON.stringify(tone)})`);
  await pause(300);
  const rows = { at_once: (await colors('rows_at_once')).rows };
  await pause(2500);
  rows.at_rest = (await colors('rows_at_rest')).rows;
  seen.rows = rows;
  return { seen, errors };
};

let failed = 0;
try {
  console.log(JSON.stringify(await use(), null, 1));
} catch (error) {
  console.error(error.stack);
  failed = 1;
}
await close();
process.exit(failed);
