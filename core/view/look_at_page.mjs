// Opens a page of core/view in headless Chromium and tells what is to be seen, as JSON on stdout.
//   node look_at_page.mjs CHROMIUM PAGE [SCREENSHOTS]
// state: data-state of the page; note: its text; errors: of the console; requests: other than for
// what is inside of the page; seen: for each step the mean colours (0..255) of the stage's left and
// right part. With a third argument every step leaves a PNG there. Needs no npm package: it talks to
// the browser over a pipe.
import { spawn } from 'node:child_process';
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';

const [chromium, page, screenshots] = process.argv.slice(2);
if (screenshots) mkdirSync(screenshots, { recursive: true });
const profile = mkdtempSync(join(tmpdir(), 'color3d-browser-'));
const browser = spawn(chromium, [
  '--headless', '--no-sandbox', '--no-first-run', '--remote-debugging-pipe', '--use-angle=swiftshader',
  '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist', '--disable-dev-shm-usage',
  '--window-size=640,560', ...(process.env.COLOR3D_BROWSER_FLAGS ?? '').split(' ').filter(Boolean),
  '--user-data-dir=' + profile,
], { stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe'] });
browser.on('error', (error) => { console.error(String(error)); process.exit(1); });

const waiting = new Map();
const errors = [], requests = [];
let buffer = '', next = 1, session;
browser.stdio[4].on('data', (data) => {
  const messages = (buffer + data).split('\0');
  buffer = messages.pop();
  for (const text of messages) receive(JSON.parse(text));
});
const receive = (message) => {
  if (message.id) {
    const { done, failed } = waiting.get(message.id);
    waiting.delete(message.id);
    return message.error ? failed(new Error(message.error.message)) : done(message.result);
  }
  const { method, params } = message;
  if (method === 'Runtime.exceptionThrown') errors.push(params.exceptionDetails.text);
  if (method === 'Runtime.consoleAPICalled' && ['error', 'warning', 'assert'].includes(params.type)) {
    errors.push(params.args.map((arg) => arg.value ?? arg.description).join(' '));
  }
  if (method === 'Log.entryAdded' && params.entry.level === 'error') errors.push(params.entry.text);
  if (method === 'Network.requestWillBeSent' && !/^(data|blob|file):/.test(params.request.url)) {
    requests.push(params.request.url);
  }
};
const send = (method, params = {}) => new Promise((done, failed) => {
  waiting.set(next, { done, failed });
  browser.stdio[3].write(JSON.stringify({ id: next++, method, params, sessionId: session }) + '\0');
});
const evaluate = async (expression) => {
  const answer = await send('Runtime.evaluate', { expression, awaitPromise: true, returnByValue: true });
  if (answer.exceptionDetails) throw new Error(answer.exceptionDetails.exception.description);
  return answer.result.value;
};
const pause = (ms) => new Promise((done) => setTimeout(done, ms));

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
  const { targetId } = await send('Target.createTarget', { url: 'about:blank' });
  session = (await send('Target.attachToTarget', { targetId, flatten: true })).sessionId;
  for (const domain of ['Page', 'Runtime', 'Log', 'Network']) await send(domain + '.enable');
  await send('Page.navigate', { url: 'file://' + resolve(page) });
  const began = Date.now();
  const state = () => evaluate('document.body?.dataset.state ?? "loading"');
  while (await state() === 'loading' && Date.now() - began < 60000) await pause(200);
  const result = { state: await state(), seconds: (Date.now() - began) / 1000, errors, requests };
  result.note = await evaluate('document.getElementById("note").textContent');
  const steps = {
    color: '', gray: '[data-shades="1"]', where_from: '[data-shades="2"]',
    back_in_color: '[data-shades="0"]', photo: '#compare',
  };
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
const ended = new Promise((done) => browser.once('exit', done));
send('Browser.close').catch(() => {});
await Promise.race([ended, pause(5000)]);
browser.kill('SIGKILL');
rmSync(profile, { recursive: true, force: true, maxRetries: 5, retryDelay: 200 });
process.exit(failed);
