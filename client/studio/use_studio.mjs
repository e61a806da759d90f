// Uses the studio in headless Chromium as a person would, and tells what was seen, as JSON on stdout.
//   node use_studio.mjs CHROMIUM ADDRESS FOLDER [SCREENSHOTS]
// ADDRESS: as `color3d studio` printed it; FOLDER: photos to choose. errors: of the console; requests: beyond
// the studio; texts: of the pages; wide: pages that are wider than a screen of 360 px; faint: texts with a
// contrast below 4.5; shades: whether the page of the finished scene is ready. With a fourth argument every page leaves a
// PNG there, wide, dark and narrow.
import { mkdirSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';

import { openBrowser, pause } from '../../tests/support/browser.mjs';
import { faintTexts } from './faint_texts.mjs';

const [chromium, address, folder, screenshots] = process.argv.slice(2);
if (screenshots) mkdirSync(screenshots, { recursive: true });
const flags = ['--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist', '--window-size=1280,900'];
const { send, open, evaluate, close, errors, requests } =
    openBrowser(chromium, flags, (type) => ['error', 'assert'].includes(type));
const origin = new URL(address).origin;
const seen = { texts: {}, wide: [], faint: [], shades: false };

const waitFor = async (expression, limit = 60000) => {
  const end = Date.now() + limit;
  while (Date.now() < end) {
    const value = await evaluate(expression);
    if (value) return value;
    const problem = await evaluate('document.querySelector(".problem p")?.textContent');
    if (problem) throw new Error('the page says: ' + problem);
    await pause(100);
  }
  throw new Error('waited in vain for ' + expression + ' at ' + await evaluate('location.href + document.body.innerText'));
};
const click = async (selector) => {
  await waitFor(`!!document.querySelector(${JSON.stringify(selector)})`);
  const { x, y } = await evaluate(`(() => {
    const element = document.querySelector(${JSON.stringify(selector)});
    element.scrollIntoView({ block: 'center' });
    const box = element.getBoundingClientRect();
    return { x: box.x + box.width / 2, y: box.y + box.height / 2 };
  })()`);
  for (const type of ['mousePressed', 'mouseReleased']) {
    await send('Input.dispatchMouseEvent', { type, x, y, button: 'left', clickCount: 1 });
  }
};
// A finger draws between two places, shares of the canvas.
const touchStroke = async (from, to) => {
  await send('Emulation.setTouchEmulationEnabled', { enabled: true });
  const box = await evaluate(`(() => {
    const canvas = document.querySelector('.paint-stage canvas');
    canvas.scrollIntoView({ block: 'center' });
    const { x, y, width, height } = canvas.getBoundingClientRect();
    return { x, y, width, height };
  })()`);
  const touch = (type, places) => send('Input.dispatchTouchEvent',
    { type, touchPoints: places.map(([x, y]) => ({ id: 0, x: box.x + x * box.width, y: box.y + y * box.height })) });
  await touch('touchStart', [from]);
  for (let i = 1; i <= 8; ++i) await touch('touchMove', [[0, 1].map((k) => from[k] + ((to[k] - from[k]) * i) / 8)]);
  await touch('touchEnd', []);
  await send('Emulation.setTouchEmulationEnabled', { enabled: false });
};
const press = async (key, code) => {
  const text = key === 'Enter' ? { text: '\r' } : {};
  for (const type of ['keyDown', 'keyUp']) {
    await send('Input.dispatchKeyEvent', { type, key, code: key, windowsVirtualKeyCode: code, ...(type === 'keyDown' ? text : {}) });
  }
};

// The page of the scene is sandboxed, a target of its own.
const stateOfScene = async (limit) => {
  const end = Date.now() + limit;
  let state = 'missing';
  while (Date.now() < end && state !== 'ready' && state !== 'failed') {
    await pause(500);
    const { targetInfos } = await send('Target.getTargets', {}, null);
    const scene = targetInfos.find(({ url, type }) => type === 'iframe' && url.includes('view.html'));
    if (!scene) continue;
    const { sessionId } = await send('Target.attachToTarget', { targetId: scene.targetId, flatten: true }, null);
    const { result } = await send('Runtime.evaluate', { expression: 'document.body?.dataset.state ?? "loading"' }, sessionId);
    await send('Target.detachFromTarget', { sessionId }, null);
    state = result.value;
  }
  return state;
};

const keep = async (name) => {
  if (!screenshots) return;
  const { data } = await send('Page.captureScreenshot', { format: 'png' });
  writeFileSync(join(screenshots, name + '.png'), Buffer.from(data, 'base64'));
};
const look = async (name) => {
  await pause(600);
  seen.texts[name] = await evaluate('document.body.innerText');
  for (const scheme of ['light', 'dark']) {
    await send('Emulation.setEmulatedMedia', { features: [{ name: 'prefers-color-scheme', value: scheme }] });
    await pause(150);
    for (const text of await evaluate(faintTexts)) seen.faint.push(`${name} ${scheme}: ${text}`);
    await keep(`${name}_${scheme}`);
  }
  await send('Emulation.setEmulatedMedia', { features: [] });
  await send('Emulation.setDeviceMetricsOverride', { width: 360, height: 740, deviceScaleFactor: 1, mobile: true });
  await pause(250);
  if (await evaluate('document.documentElement.scrollWidth') > 360) seen.wide.push(name);
  await keep(`${name}_narrow`);
  await send('Emulation.clearDeviceMetricsOverride');
};

const use = async () => {
  await open();
  await send('Page.navigate', { url: address });
  await waitFor('!!document.querySelector(".drop-area")');
  await look('home');

  await send('DOM.enable');
  const { root } = await send('DOM.getDocument');
  const { nodeId } = await send('DOM.querySelector', { nodeId: root.nodeId, selector: '#choose-folder' });
  await send('DOM.setFileInputFiles', { nodeId, files: [resolve(folder)] });
  await waitFor('location.hash.startsWith("#set/") && !!document.querySelector("#go-on")');
  await waitFor('!!document.querySelector(".plan")');
  await look('photos');

  // By keyboard alone.
  await evaluate('document.querySelector("#go-on").focus()');
  await press('Enter', 13);
  await waitFor('location.hash.startsWith("#key/")');
  await waitFor('!!document.querySelector("#start")', 120000);
  await waitFor('document.querySelector("#key-photo")?.complete');
  await look('key');
  await click('input[value=picture]');
  await waitFor('!!document.querySelector("#colored-picture")');
  await look('picture');
  await click('input[value=automatic]');
  await waitFor('document.querySelector("#told").textContent === "" && document.querySelector("#key-photo").src.startsWith("blob:")');
  await click('#paint');
  await waitFor('!!document.querySelector(".paint-stage canvas")');
  await touchStroke([0.4, 0.45], [0.6, 0.55]);
  await waitFor('document.querySelector(".paint").dataset.count === "1" && document.querySelector(".paint").dataset.preview === "shown"');
  await look('paint');
  await click('#start');
  await waitFor('location.hash.startsWith("#job/") && !!document.querySelector(".stage")');
  await waitFor('!!document.querySelector(".gallery img")', 90000);
  await look('running');

  // The page is closed and opened again.
  await send('Page.navigate', { url: 'about:blank' });
  await send('Page.navigate', { url: origin + '/' });
  await waitFor('!!document.querySelector(".card")');
  await look('again');
  await click('.card');
  await waitFor('document.querySelector("main").dataset.state === "done"', 240000);
  await waitFor('!!document.querySelector("#scene")');
  seen.shades = await stateOfScene(90000) === 'ready';
  await look('done');
  return { ...seen, errors, requests: requests.filter((url) => !url.startsWith(origin + '/')) };
};

let failed = 0;
try {
  console.log(JSON.stringify(await use(), null, 1));
} catch (error) {
  console.error(error.stack, JSON.stringify({ errors, requests }));
  await keep('failed').catch(() => undefined);
  failed = 1;
}
await close();
process.exit(failed);
