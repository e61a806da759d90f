// Plays a page of core/view that moves in headless Chromium, by its keys, and tells what happened, as
// JSON on stdout.
//   node play_page.mjs CHROMIUM PAGE FOLDER WIDTH HEIGHT [film] STOP...
// The stage gets WIDTH x HEIGHT px. FOLDER gets the stage at each STOP of the time slider as
// STOP.png, and once more while the scene plays as playing.png; with `film` as the camera of the film sees it, else from
// the key view. clocks: the text of the clock at each stop; keys: what keys
// changed; heard: how the sound runs along; heap: bytes of JavaScript after the second and after the tenth of ten loops; errors,
// requests: as look_at_page.mjs. A page of a still scene takes no stops: still.png.
import { mkdirSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';

import { openBrowser, pause } from '../../tests/support/browser.mjs';

const [chromium, page, folder, width, height, ...words] = process.argv.slice(2);
const asFilm = words[0] === 'film', stops = asFilm ? words.slice(1) : words;
mkdirSync(folder, { recursive: true });
const flags = [
  '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist',
  ...(process.env.COLOR3D_BROWSER_FLAGS ?? '').split(' ').filter(Boolean),
];
const { send, open, evaluate, close, errors, requests } =
    openBrowser(chromium, flags, (type) => ['error', 'warning', 'assert'].includes(type));

const codes = { ' ': ['Space', 32], Home: ['Home', 36], ArrowRight: ['ArrowRight', 39],
                PageUp: ['PageUp', 33], '.': ['Period', 190], ',': ['Comma', 188] };
const key = async (name) => {
  const [code, number] = codes[name];
  const text = name.length === 1 ? name : undefined;
  const event = { key: name, code, windowsVirtualKeyCode: number };
  await send('Input.dispatchKeyEvent', { type: text ? 'keyDown' : 'rawKeyDown', text, ...event });
  await send('Input.dispatchKeyEvent', { type: 'keyUp', ...event });
};
const picture = async () => {
  const { data } = await send('Page.captureScreenshot', {
    format: 'png', clip: { x: 0, y: 0, width: Number(width), height: Number(height), scale: 1 } });
  return data;
};
const save = (name, data) => writeFileSync(join(folder, name + '.png'), Buffer.from(data, 'base64'));
// Once the viewer has sorted and drawn: when three pictures in a row are the same.
const shoot = async (name) => {
  let same = 0, before = '';
  for (let i = 0; i < 40 && same < 2; ++i) {
    await pause(500);
    const now = await picture();
    same = now === before ? same + 1 : 0;
    before = now;
  }
  save(name, before);
};
const clock = () => evaluate('document.getElementById("clock").textContent');
const position = () => evaluate('Number(document.getElementById("moment").value)');
const heap = async () => {
  await send('HeapProfiler.collectGarbage');
  const { metrics } = await send('Performance.getMetrics');
  return metrics.find((metric) => metric.name === 'JSHeapUsedSize').value;
};
const size = (bars) => send('Emulation.setDeviceMetricsOverride', {
  width: Number(width), height: Number(height) + bars, deviceScaleFactor: 1, mobile: false });

const playLoops = async (count) => {
  await evaluate(`window.seenLoops = 0; window.before = -1; window.watch = setInterval(() => {
    const now = Number(document.getElementById('moment').value);
    if (now < window.before) ++window.seenLoops;
    window.before = now;
  }, 20)`);
  const began = Date.now();
  while (await evaluate('window.seenLoops') < count && Date.now() - began < 60000) await pause(100);
  await evaluate('clearInterval(window.watch)');
  return evaluate('window.seenLoops');
};

// How the sound goes along: seconds between it and the slider (largest_apart: while all plays at speed 1, beginnings of
// loops with it, where the picture waits for the sound; after_scrub: at rest, and played_after_scrub: played on, after the
// slider was moved); level and hz: root mean square and pitch of what
// is heard; stops: whether the button switches it off.
const hear = async () => {
  const sound = 'document.getElementById("heard")';
  await evaluate(`(() => {
    const facts = JSON.parse(document.getElementById('facts').textContent), moment = document.getElementById('moment');
    const value = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value');
    window.apart = () => Math.abs(moment.value / moment.max * facts.motion.seconds - ${sound}.currentTime);
    window.seenApart = [];  // each time that the page moves the slider
    Object.defineProperty(moment, 'value', { get: () => value.get.call(moment), set: (next) => {
      value.set.call(moment, next);
      window.seenApart.push(window.apart());
    } });
    document.getElementById('speed').value = '1';
  })()`);
  const largest = async (ms) => {
    await evaluate('window.seenApart = []; 1');
    await pause(ms);
    // Others: it loops just now.
    const all = (await evaluate('window.seenApart')).filter((seconds) => seconds < 1);
    return all.length ? Math.max(...all) : Infinity;
  };
  await pause(1000);
  const result = { largest_apart: await largest(3000), plays: await evaluate(`!${sound}.paused`) };
  const listened = await evaluate(`(async () => {
    const context = new AudioContext(), analyser = context.createAnalyser();
    context.createMediaStreamSource(${sound}.captureStream()).connect(analyser);
    await context.resume();
    const wave = new Float32Array(analyser.fftSize), pitch = new Float32Array(analyser.frequencyBinCount);
    let level = 0, hz = 0;
    for (let i = 0; i < 30; ++i) {
      await new Promise((done) => setTimeout(done, 50));
      analyser.getFloatTimeDomainData(wave);
      const now = Math.hypot(...wave) / Math.sqrt(wave.length);
      if (now <= level) continue;
      level = now;
      analyser.getFloatFrequencyData(pitch);
      hz = pitch.indexOf(Math.max(...pitch)) * context.sampleRate / analyser.fftSize;
    }
    await context.close();
    return { level, hz };
  })()`);
  // A person drags the slider while it plays, and plays on.
  await evaluate('document.getElementById("moment").focus()');
  await key('Home');
  for (const name of ['PageUp', 'PageUp', 'ArrowRight', 'ArrowRight']) await key(name);
  await pause(500);
  result.after_scrub = await evaluate('window.apart()');
  result.scrubbed_to = await evaluate(`${sound}.currentTime`);
  await evaluate('document.activeElement.blur()');
  await key(' ');
  await pause(700);
  result.played_after_scrub = await largest(400);
  await evaluate('document.getElementById("sound").click()');
  await pause(300);
  return { ...result, ...listened, stops: await evaluate(`${sound}.paused`) };
};

const look = async () => {
  await open();
  await send('Performance.enable');
  await size(0);
  await send('Page.navigate', { url: 'file://' + resolve(page) });
  const began = Date.now();
  const state = () => evaluate('document.body?.dataset.state ?? "loading"');
  while (await state() === 'loading' && Date.now() - began < 60000) await pause(200);
  const result = { state: await state(), errors, requests, clocks: [], keys: {} };
  await size(await evaluate('innerHeight - document.getElementById("stage").clientHeight'));
  await evaluate('document.getElementById("note").style.display = "none"');
  await pause(2500);
  if (!stops.length) {
    await shoot('still');
    return result;
  }
  const seconds = [await clock()];
  if (asFilm) await evaluate('document.getElementById("film").click()');
  await evaluate('document.getElementById("moment").focus()');
  for (const stop of stops) {
    await key('Home');
    for (let i = await position(); i < Number(stop); ++i) await key('ArrowRight');
    result.clocks.push(await clock());
    await shoot(stop);
  }
  result.opened_at = seconds[0];
  await key('Home');
  for (const name of ['.', '.', ',']) await key(name);
  result.keys.frame_steps = await position();
  await evaluate('document.activeElement.blur()');
  await evaluate('document.getElementById("speed").value = "2"');
  await key(' ');
  result.keys.space_plays = await evaluate('document.getElementById("play").getAttribute("aria-pressed")');
  await playLoops(2);
  const before = await heap();
  result.loops = await playLoops(8);
  if (await evaluate('!document.getElementById("sound").hidden')) result.heard = await hear();
  result.heap = [before, await heap()];
  save('playing', await picture());
  await key(' ');
  result.keys.space_pauses = await evaluate('document.getElementById("play").getAttribute("aria-pressed")');
  const stopped = await position();
  await pause(500);
  result.keys.pause_holds = await position() === stopped;
  result.note = await evaluate('document.getElementById("note").textContent');
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
