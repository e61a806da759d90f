// Colours a film in the studio in headless Chromium, by mouse and keyboard as a person would, and tells what was seen,
// as JSON on stdout.
//   node use_film.mjs CHROMIUM ADDRESS FILM [SCREENSHOTS]
// ADDRESS: as `color3d studio` printed it; FILM: a file to choose. errors: of the console; requests: beyond the
// studio; texts: of the pages; wide: pages wider than a screen of 360 px; facts: what was measured. With a fourth
// argument every page leaves a PNG there, light, dark and narrow.
import { mkdirSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';

import { openBrowser, pause } from '../../tests/support/browser.mjs';

const [chromium, address, film, screenshots] = process.argv.slice(2);
if (screenshots) mkdirSync(screenshots, { recursive: true });
const flags = ['--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist', '--window-size=1280,1000'];
const { send, open, evaluate, close, errors, requests } =
    openBrowser(chromium, flags, (type) => ['error', 'assert'].includes(type));
const origin = new URL(address).origin;
const seen = { texts: {}, wide: [], facts: {} };

const slow = Number(process.env.COLOR3D_SLOW) || 1;  // times as long to wait, on a busy machine
const waitFor = async (expression, limit = 60000) => {
  const end = Date.now() + slow * limit;
  while (Date.now() < end) {
    const value = await evaluate(expression);
    if (value) return value;
    const problem = await evaluate('document.querySelector(".problem p")?.textContent');
    if (problem) throw new Error('the page says: ' + problem);
    await pause(100);
  }
  throw new Error('waited in vain for ' + expression + ' at ' + await evaluate('location.href + document.body.innerText'));
};
const mouse = (type, x, y) => send('Input.dispatchMouseEvent', { type, x, y, button: 'left', buttons: type === 'mouseReleased' ? 0 : 1, clickCount: 1 });
const placeOf = async (selector) => {
  await waitFor(`!!document.querySelector(${JSON.stringify(selector)})`);
  return evaluate(`(() => {
    const element = document.querySelector(${JSON.stringify(selector)});
    element.scrollIntoView({ block: 'center' });
    const box = element.getBoundingClientRect();
    return { x: box.x + box.width / 2, y: box.y + box.height / 2, left: box.x, width: box.width };
  })()`);
};
const click = async (selector) => {
  const { x, y } = await placeOf(selector);
  await mouse('mousePressed', x, y);
  await mouse('mouseReleased', x, y);
};
const drag = async (selector, dx) => {
  const { x, y } = await placeOf(selector);
  await mouse('mousePressed', x, y);
  for (let i = 1; i <= 8; ++i) await mouse('mouseMoved', x + dx * i / 8, y);
  await mouse('mouseReleased', x + dx, y);
};
const codes = { Enter: 13, ' ': 32, ArrowRight: 39, ArrowLeft: 37, '.': 190, ',': 188 };
const press = async (key, modifiers = 0) => {
  const text = key === 'Enter' ? '\r' : key.length === 1 && !modifiers ? key : undefined;
  const event = { key, code: key === ' ' ? 'Space' : key, modifiers, windowsVirtualKeyCode: codes[key] ?? key.toUpperCase().charCodeAt(0) };
  await send('Input.dispatchKeyEvent', { type: text ? 'keyDown' : 'rawKeyDown', text, ...event });
  await send('Input.dispatchKeyEvent', { type: 'keyUp', ...event });
};
const keep = async (name) => {
  if (!screenshots) return;
  const size = await evaluate('({ width: innerWidth, height: Math.min(3000, Math.max(innerHeight, document.documentElement.scrollHeight)) })');
  const { data } = await send('Page.captureScreenshot', { format: 'png', captureBeyondViewport: true, clip: { x: 0, y: 0, ...size, scale: 1 } });
  writeFileSync(join(screenshots, name + '.png'), Buffer.from(data, 'base64'));
};
const look = async (name) => {
  await pause(600);
  seen.texts[name] = await evaluate('document.body.innerText');
  for (const scheme of screenshots ? ['light', 'dark'] : []) {
    await send('Emulation.setEmulatedMedia', { features: [{ name: 'prefers-color-scheme', value: scheme }] });
    await pause(150);
    await keep(`${name}_${scheme}`);
  }
  await send('Emulation.setEmulatedMedia', { features: [] });
  await send('Emulation.setDeviceMetricsOverride', { width: 360, height: 740, deviceScaleFactor: 1, mobile: true });
  await pause(300);
  if (await evaluate('document.documentElement.scrollWidth') > 360) seen.wide.push(name);
  await keep(`${name}_narrow`);
  await send('Emulation.clearDeviceMetricsOverride');
  await pause(200);
};
const moment = () => evaluate('Number(document.getElementById("film-moment").value)');
const clock = () => evaluate('document.getElementById("film-clock").textContent');
// Mean colours (0..255) of the left and the right part of the film as it is on the screen.
const colors = async () => {
  await placeOf('.film-screen');
  await pause(500);
  const box = await evaluate('(() => { const { x, y, width, height } = document.querySelector(".film-screen").getBoundingClientRect(); return { x, y, width, height }; })()');
  const { data } = await send('Page.captureScreenshot', { format: 'png', clip: { ...box, scale: 1 } });
  return evaluate(`(async () => {
    const picture = await createImageBitmap(new Blob([Uint8Array.from(atob('${data}'), (letter) => letter.charCodeAt(0))]));
    const canvas = new OffscreenCanvas(picture.width, picture.height), context = canvas.getContext('2d');
    context.drawImage(picture, 0, 0);
    const chroma = (from, to) => {
      const x = Math.round(from * picture.width), width = Math.round((to - from) * picture.width);
      const part = context.getImageData(x, Math.round(0.1 * picture.height), width, Math.round(0.25 * picture.height)).data;
      let sum = 0;
      for (let i = 0; i < part.length; i += 4) sum += Math.max(part[i], part[i + 1], part[i + 2]) - Math.min(part[i], part[i + 1], part[i + 2]);
      return sum / (part.length / 4);
    };
    return { left: chroma(0.05, 0.4), right: chroma(0.6, 0.95) };
  })()`);
};
const heap = async () => {
  await send('HeapProfiler.collectGarbage');
  const { metrics } = await send('Performance.getMetrics');
  return metrics.find((metric) => metric.name === 'JSHeapUsedSize').value;
};
const loops = async (count) => {
  await evaluate(`window.seenLoops = 0; window.before = -1; window.watch = setInterval(() => {
    const now = Number(document.getElementById('film-moment').value);
    if (now < window.before) ++window.seenLoops;
    window.before = now;
  }, 15)`);
  const end = Date.now() + 90000;
  while (await evaluate('window.seenLoops') < count && Date.now() < end) await pause(50);
  await evaluate('clearInterval(window.watch)');
  return evaluate('window.seenLoops');
};

const play = async () => {
  const { facts } = seen;
  await evaluate('document.getElementById("film-moment").focus()');
  await press('Home');
  await press('.');
  await press('.');
  await press(',');
  facts.steps = await moment();
  await evaluate('document.activeElement.blur()');
  await press(' ');
  await waitFor('document.getElementById("film-play").textContent === "Pause"');
  facts.loops_before = await loops(2);
  const before = await heap();
  facts.loops = await loops(10);
  facts.heap = [before, await heap()];
  await press(' ');
  const stopped = await moment();
  await pause(400);
  facts.pause_holds = await moment() === stopped;
};

const use = async () => {
  await open();
  await send('Performance.enable');
  await send('Page.navigate', { url: address });
  await waitFor('!!document.querySelector(".drop-area")');
  await send('DOM.enable');
  const { root } = await send('DOM.getDocument');
  const { nodeId } = await send('DOM.querySelector', { nodeId: root.nodeId, selector: '#choose-files' });
  await send('DOM.setFileInputFiles', { nodeId, files: [resolve(film)] });
  await waitFor('location.hash.startsWith("#film/") && !!document.querySelector("#film-moment")');
  await waitFor('document.querySelector("main").dataset.state === "chosen"', 120000);
  await look('chosen');
  const { facts } = seen;
  facts.movie_plays = await waitFor('document.querySelector(".film-video").readyState >= 2 || document.querySelector(".film-screen").dataset.movie === "no"')
      && await evaluate('!document.querySelector(".film-video").hidden');
  facts.gray = await colors();
  facts.shots = await evaluate('document.querySelectorAll(".film-shots span").length');

  // Scrub by mouse on the strip, and by keys.
  const strip = await placeOf('.film-strip');
  await mouse('mousePressed', strip.left + 0.75 * strip.width, strip.y);
  await mouse('mouseMoved', strip.left + 0.5 * strip.width, strip.y);
  await mouse('mouseReleased', strip.left + 0.5 * strip.width, strip.y);
  facts.scrubbed = (await moment()) / await evaluate('Number(document.getElementById("film-moment").max)');

  // The proposed frame has automatic colours.
  facts.keys = await evaluate('document.querySelectorAll(".film-key:not(.proposed)").length');
  facts.proposals = await evaluate('[...document.querySelectorAll(".film-key.proposed")].map((mark) => mark.title)');
  await click('#film-start');
  await waitFor('location.hash.split("/").length === 3');
  await waitFor('document.querySelector(".film-early:not([hidden])") || document.querySelector("[data-pictures=early] img[src]") || document.querySelector("main").dataset.state === "done"', 120000);
  facts.early = await evaluate("document.querySelectorAll(\"[data-pictures=early] img\").length");
  await look('running');
  await waitFor('document.querySelector("main").dataset.state === "done"', 240000);
  await waitFor('document.querySelector(".film-video").readyState >= 2 || document.querySelector(".film-screen").dataset.movie === "no"');
  await look('done');
  facts.colored = await colors();
  await click('#film-compare');
  facts.compared = await colors();
  await keep('compared');
  await click('#film-compare');
  await play();

  // Other colours for a part: painted, its ends dragged by the mouse and moved by keys.
  await evaluate('document.getElementById("film-moment").focus()');
  await press('Home');
  for (let i = 0; i < 6; ++i) await press('ArrowRight');
  await pause(400);
  await click('#add-part');
  await waitFor('!!document.querySelector("#parts-0-way")');
  await evaluate('document.getElementById("parts-0-way").focus()');
  await press('P');  // the option that begins with it: Paint
  await waitFor('!!document.querySelector("#film-painter canvas")', 20000);
  await pause(800);
  const canvas = await placeOf('#film-painter canvas');
  await mouse('mousePressed', canvas.x - 60, canvas.y);
  for (let i = 0; i <= 10; ++i) await mouse('mouseMoved', canvas.x - 60 + 12 * i, canvas.y);
  await mouse('mouseReleased', canvas.x + 60, canvas.y);
  await look('painting');
  await click('#paint-done');
  const ends = () => evaluate('[...document.querySelectorAll(".film-edge")].map((edge) => Number(edge.getAttribute("aria-valuenow")))');
  facts.part_first = await ends();
  await drag('.film-edge.end', -150);
  facts.part_dragged = await ends();
  await evaluate('document.querySelector(".film-edge.begin").focus()');
  await press('ArrowRight');
  facts.part_by_key = await ends();
  await evaluate('document.activeElement.blur()');
  await press('z', 2);
  facts.part_undone = await ends();
  await press('z', 10);
  await look('part');
  const before = await evaluate('location.hash');
  await click('#film-start');
  await waitFor(`location.hash !== ${JSON.stringify(before)}`);
  await waitFor('document.querySelector("main").dataset.state === "done"', 240000);
  await look('again');
  facts.part_kept = await ends();
  return { ...seen, errors, requests: requests.filter((url) => !url.startsWith(origin + '/')) };
};

let failed = 0;
try {
  console.log(JSON.stringify(await use(), null, 1));
} catch (error) {
  console.error(error.stack, JSON.stringify({ errors, requests, facts: seen.facts }));
  await keep('failed').catch(() => undefined);
  failed = 1;
}
await close();
process.exit(failed);
