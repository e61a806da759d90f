// Opens a report in headless Chromium at the widths of a phone and a desktop, light and dark, and
// prints measurements as JSON on stdout.
//   node look_at_report.mjs CHROMIUM PAGE [SCREENSHOTS]
// errors: messages of the console. requests: requests to other files or hosts. looks: for each width
// and scheme, the page's width beyond the window (px), the time of the first paint (ms), the
// background, the visible part of the picture before with the slider at 20 %, and the number of
// pictures without alternative text. With SCREENSHOTS, each look is saved there as PNG files.
import { mkdirSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';

import { openBrowser, pause } from '../../tests/support/browser.mjs';

const [chromium, page, screenshots] = process.argv.slice(2);
if (screenshots) mkdirSync(screenshots, { recursive: true });
const { send, open, evaluate, close, errors, requests } = openBrowser(chromium, ['--disable-gpu']);

const measure = `(() => {
  const root = document.documentElement, at = document.getElementById('at');
  for (const details of document.querySelectorAll('details')) details.open = true;
  const look = {
    overflow_px: Math.max(root.scrollWidth, document.body.scrollWidth) - innerWidth,
    first_paint_ms: performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? -1,
    background: getComputedStyle(document.body).backgroundColor,
    views: document.querySelectorAll('#view option').length,
    without_text: [...document.images].filter((image) => !image.alt).length,
  };
  if (at) {
    at.value = 20;
    at.dispatchEvent(new Event('input'));
    look.clip = getComputedStyle(document.querySelector('.compare .over')).clipPath;
    const view = document.getElementById('view'), shown = document.querySelector('.compare img');
    const before = shown.src;
    view.selectedIndex = view.length - 1;
    view.dispatchEvent(new Event('change'));
    look.view_changes = shown.src !== before;
    view.selectedIndex = 0;
    view.dispatchEvent(new Event('change'));
  }
  return look;
})()`;

const lookAs = async (name, width, height, scheme) => {
  await open();
  await send('Emulation.setDeviceMetricsOverride',
      { width, height, deviceScaleFactor: 1, mobile: width < 500 });
  await send('Emulation.setEmulatedMedia', { features: [{ name: 'prefers-color-scheme', value: scheme }] });
  await send('Page.navigate', { url: 'file://' + resolve(page) });
  for (let i = 0; i < 150; ++i) {
    await pause(200);
    if (await evaluate('location.protocol === "file:" && document.readyState === "complete"')) break;
  }
  await pause(300);
  if (screenshots) {
    const { data } = await send('Page.captureScreenshot', { format: 'png' });
    writeFileSync(join(screenshots, name + '_top.png'), Buffer.from(data, 'base64'));
  }
  const look = await evaluate(measure);
  if (screenshots) {
    await pause(1000);
    const { data } = await send('Page.captureScreenshot', { format: 'png', captureBeyondViewport: true,
      clip: { x: 0, y: 0, width, height: Math.min(9000, await evaluate('document.body.scrollHeight')), scale: 1 } });
    writeFileSync(join(screenshots, name + '.png'), Buffer.from(data, 'base64'));
  }
  return look;
};

let failed = 0;
try {
  const looks = {};
  for (const scheme of ['light', 'dark']) {
    looks['phone_' + scheme] = await lookAs('phone_' + scheme, 320, 640, scheme);
    looks['desktop_' + scheme] = await lookAs('desktop_' + scheme, 1280, 800, scheme);
  }
  console.log(JSON.stringify({ looks, errors, requests }, null, 1));
} catch (error) {
  console.error(error.stack);
  failed = 1;
}
await close();
process.exit(failed);
