// A person's hand and eye on a page in headless Chromium (browser.mjs).
//   const hand = openPage(CHROMIUM, ADDRESS, SCREENSHOTS, options);
//   await hand.tell(async () => { await hand.click('#start'); return { ... }; });
// Selectors are CSS, or XPath if they begin with "//".
import { existsSync, mkdirSync, readdirSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';

import { openBrowser, pause } from './browser.mjs';
import { faintTexts } from './faint_texts.mjs';

// For pages that draw in WebGL.
export const drawnBySoftware = ['--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'];

const codes = { Enter: 13, ' ': 32, ArrowLeft: 37, ArrowUp: 38, ArrowRight: 39, ArrowDown: 40, Home: 36, '.': 190, ',': 188 };

// Options: flags of Chromium; byTouch: clicks and drags are those of a finger; limit: ms to wait for something; every: ms between looks while waiting; whole: pictures of
// the page beyond the window; narrowHeight: px of the narrow screen.
export const openPage = (chromium, address, screenshots, options = {}) => {
  const { flags = [], byTouch = false, limit: usual = 60000, every = 100, whole = false, narrowHeight = 740 } = options;
  if (screenshots) mkdirSync(screenshots, { recursive: true });
  const browser = openBrowser(chromium, flags, (type) => ['error', 'assert'].includes(type));
  const { send, open, evaluate, close, errors, requests } = browser;
  const origin = new URL(address).origin;
  const patience = Number(process.env.COLOR3D_SLOW) || 1; // times as long to wait, on a busy machine
  // What look() saw: texts of pages; pages that are wider than a screen of 360 px; texts with a contrast below 4.5.
  const seen = { texts: {}, wide: [], faint: [] };

  const find = (selector) => (selector.startsWith('//')
    ? `document.evaluate(${JSON.stringify(selector)}, document, null, XPathResult.FIRST_ORDERED_NODE_TYPE).singleNodeValue`
    : `document.querySelector(${JSON.stringify(selector)})`);
  // Fails at once if the page shows a problem, unless `despite` it. `read`: evaluates in another page.
  const waitFor = async (expression, limit = usual, { despite = false, read = evaluate } = {}) => {
    for (const end = Date.now() + patience * limit; Date.now() < end; await pause(every)) {
      const value = await read(expression);
      if (value) return value;
      const problem = !despite && await read('document.querySelector(".problem p")?.textContent');
      if (problem) throw new Error('the page says: ' + problem);
    }
    throw new Error(`waited in vain for ${expression} at ${await read('location.href')}`);
  };
  // The box of an element, px of the window, once it is there.
  const boxOf = async (selector) => {
    await waitFor(`!!${find(selector)}`, usual, { despite: true });
    return evaluate(`(() => {
      const element = ${find(selector)};
      element.scrollIntoView({ block: 'center' });
      const { x, y, width, height } = element.getBoundingClientRect();
      return { x, y, width, height };
    })()`);
  };

  const mouse = (type, x, y) => send('Input.dispatchMouseEvent',
    { type, x, y, button: 'left', buttons: type === 'mouseReleased' ? 0 : 1, clickCount: 1 });
  const touch = (type, ...places) => send('Input.dispatchTouchEvent', { type, touchPoints: places.map(([x, y]) => ({ id: 0, x, y })) });
  const clickAt = async (x, y) => {
    if (byTouch) {
      await touch('touchStart', [x, y]);
      return touch('touchEnd');
    }
    await mouse('mousePressed', x, y);
    return mouse('mouseReleased', x, y);
  };
  const click = async (selector) => {
    const { x, y, width, height } = await boxOf(selector);
    await clickAt(x + width / 2, y + height / 2);
  };
  const drag = async ([x0, y0], [x1, y1], steps = 8) => {
    const [down, move, up] = byTouch
      ? [(x, y) => touch('touchStart', [x, y]), (x, y) => touch('touchMove', [x, y]), () => touch('touchEnd')]
      : ['mousePressed', 'mouseMoved', 'mouseReleased'].map((type) => (x, y) => mouse(type, x, y));
    await down(x0, y0);
    for (let i = 1; i <= steps; ++i) await move(x0 + ((x1 - x0) * i) / steps, y0 + ((y1 - y0) * i) / steps);
    await up(x1, y1);
  };
  const press = async (key, modifiers = 0) => {
    const text = key === 'Enter' ? '\r' : key.length === 1 && !modifiers ? key : undefined;
    const event = { key, code: key === ' ' ? 'Space' : key, modifiers, windowsVirtualKeyCode: codes[key] ?? key.toUpperCase().charCodeAt(0) };
    await send('Input.dispatchKeyEvent', { type: text ? 'keyDown' : 'rawKeyDown', text, ...event });
    await send('Input.dispatchKeyEvent', { type: 'keyUp', ...event });
  };
  // Clicks again where the page moved below the first click.
  const type = async (selector, text) => {
    for (let tries = 0; tries < 3; ++tries) {
      await click(selector);
      if (await evaluate(`document.activeElement === ${find(selector)}`)) break;
    }
    await send('Input.insertText', { text });
  };
  // Drags a file or folder of the machine to the middle of an element and drops it.
  const drop = async (selector, file) => {
    const { x, y, width, height } = await boxOf(selector);
    for (const event of ['dragEnter', 'dragOver', 'drop']) {
      await send('Input.dispatchDragEvent', {
        type: event, x: x + width / 2, y: y + height / 2, data: { items: [], files: [resolve(file)], dragOperationsMask: 1 },
      });
    }
  };
  // Chooses a file or folder in a field for files.
  const choose = async (selector, file) => {
    await send('DOM.enable');
    const { root } = await send('DOM.getDocument');
    const { nodeId } = await send('DOM.querySelector', { nodeId: root.nodeId, selector });
    await send('DOM.setFileInputFiles', { nodeId, files: [resolve(file)] });
  };

  // What the page saves goes to this folder, until another is named.
  let saved;
  const saveTo = async (folder) => {
    saved = resolve(folder);
    mkdirSync(saved, { recursive: true });
    await send('Browser.setDownloadBehavior', { behavior: 'allow', downloadPath: saved }, null);
  };
  const savedAs = async (name, limit = 120000) => {
    for (const end = Date.now() + patience * limit; Date.now() < end; await pause(every)) {
      if (existsSync(join(saved, name)) && !readdirSync(saved).some((file) => file.endsWith('.crdownload'))) return;
    }
    throw new Error(`${name} was not saved; there are ${readdirSync(saved)}`);
  };
  // A link or button of the page by its text.
  const clickText = (text) => click(`//main//*[self::a or self::button][normalize-space()="${text}"]`);

  // Leaves NAME.png in SCREENSHOTS, if that is given.
  const keep = async (name) => {
    if (!screenshots) return;
    const clip = whole && await evaluate(`({ x: 0, y: 0, scale: 1, width: innerWidth,
      height: Math.min(3000, Math.max(innerHeight, document.documentElement.scrollHeight)) })`);
    const { data } = await send('Page.captureScreenshot', { format: 'png', ...(clip ? { captureBeyondViewport: true, clip } : {}) });
    writeFileSync(join(screenshots, name + '.png'), Buffer.from(data, 'base64'));
  };
  // Looks at the page in light, in dark and on a narrow screen.
  const look = async (name) => {
    await pause(600);
    seen.texts[name] = await evaluate('document.body.innerText');
    for (const scheme of ['light', 'dark']) {
      await send('Emulation.setEmulatedMedia', { features: [{ name: 'prefers-color-scheme', value: scheme }] });
      await pause(200);
      for (const text of await evaluate(faintTexts)) seen.faint.push(`${name} ${scheme}: ${text}`);
      await keep(`${name}_${scheme}`);
    }
    await send('Emulation.setEmulatedMedia', { features: [] });
    await send('Emulation.setDeviceMetricsOverride', { width: 360, height: narrowHeight, deviceScaleFactor: 1, mobile: true });
    await pause(400);
    if (await evaluate('document.documentElement.scrollWidth') > 360) seen.wide.push(name);
    await keep(`${name}_narrow`);
    await send('Emulation.clearDeviceMetricsOverride');
    await pause(200);
  };

  // Waits until the page is there: the address may lead to another one, which ends what is evaluated on it.
  const arrive = async () => {
    const isThere = "document.readyState === 'complete' && location.pathname !== '/open'";
    for (const end = Date.now() + patience * usual; Date.now() < end; await pause(every)) {
      if (await evaluate(isThere).catch(() => false)) return;
    }
    throw new Error(`the page of ${address} does not come`);
  };
  // Opens the page, does `use`, prints what it returns as JSON with seen, errors (of the console) and requests (beyond
  // the address's origin), and ends the program: status 1 if `use` fails.
  const tell = async (use) => {
    let failed = 0;
    const beyond = () => requests.filter((url) => !url.startsWith(origin + '/'));
    try {
      await open();
      if (byTouch) await send('Emulation.setTouchEmulationEnabled', { enabled: true });
      await send('Page.navigate', { url: address });
      await arrive();
      console.log(JSON.stringify({ ...seen, ...await use(), errors, requests: beyond() }, null, 1));
    } catch (error) {
      console.error(error.stack, JSON.stringify({ ...seen, texts: undefined, errors, requests: beyond() }),
        await evaluate('document.body.innerText').catch(() => ''));
      await keep('failed').catch(() => undefined);
      failed = 1;
    }
    await close();
    process.exit(failed);
  };
  return {
    send, evaluate, origin, seen, waitFor, boxOf, mouse, clickAt, click, drag, press, type, drop, choose,
    saveTo, savedAs, clickText, keep, look, tell,
  };
};
