// Opens a report in headless Chromium at the widths of a phone and a desktop, light and dark, and
// tells what is to be seen, as JSON on stdout.
//   node look_at_report.mjs CHROMIUM PAGE [SCREENSHOTS]
// errors: of the console; requests: other than for what is inside of the page; looks: for each look
// the page's width beyond the window (px), the time of the first paint (ms), the background, how
// much of the picture before is shown after the slider went to 20 %, and pictures without a text.
// With a third argument every look leaves PNG files there. Needs no npm package: it talks to the
// browser over a pipe.
import { spawn } from 'node:child_process';
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';

const [chromium, page, screenshots] = process.argv.slice(2);
if (screenshots) mkdirSync(screenshots, { recursive: true });
const profile = mkdtempSync(join(tmpdir(), 'color3d-browser-'));
const browser = spawn(chromium, [
  '--headless', '--no-sandbox', '--no-first-run', '--remote-debugging-pipe', '--disable-gpu',
  '--disable-dev-shm-usage', '--user-data-dir=' + profile,
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
const receive = ({ id, error, result, method, params }) => {
  if (id) {
    const { done, failed } = waiting.get(id);
    waiting.delete(id);
    return error ? failed(new Error(error.message)) : done(result);
  }
  if (method === 'Runtime.exceptionThrown') errors.push(params.exceptionDetails.text);
  if (method === 'Runtime.consoleAPICalled') errors.push(params.args.map((arg) => arg.value).join(' '));
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
  session = undefined;
  const { targetId } = await send('Target.createTarget', { url: 'about:blank' });
  session = (await send('Target.attachToTarget', { targetId, flatten: true })).sessionId;
  for (const domain of ['Page', 'Runtime', 'Log', 'Network']) await send(domain + '.enable');
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
session = undefined;
const ended = new Promise((done) => browser.once('exit', done));
send('Browser.close').catch(() => {});
await Promise.race([ended, pause(5000)]);
browser.kill('SIGKILL');
rmSync(profile, { recursive: true, force: true, maxRetries: 5, retryDelay: 200 });
process.exit(failed);
