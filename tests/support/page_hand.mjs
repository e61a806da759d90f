// A person's hand and eye on a page in headless Chromium (browser.mjs).
//   const { waitFor, click, type, press, look, wide } = handOn(browser, SCREENSHOTS);
// Selectors are CSS, or XPath if they begin with "//". look(NAME) leaves PNGs light, dark and narrow in SCREENSHOTS, if
// that is given, and adds NAME to `wide` if the page is wider than a screen of 360 px.
import { mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';

import { pause } from './browser.mjs';

export const handOn = ({ send, evaluate }, screenshots) => {
  if (screenshots) mkdirSync(screenshots, { recursive: true });
  const wide = [];
  const find = (selector) => (selector.startsWith('//')
    ? `document.evaluate(${JSON.stringify(selector)}, document, null, XPathResult.FIRST_ORDERED_NODE_TYPE).singleNodeValue`
    : `document.querySelector(${JSON.stringify(selector)})`);
  // Fails at once if the page shows a problem, unless `despite` it.
  const waitFor = async (expression, limit = 60000, despite = false) => {
    for (const end = Date.now() + limit; Date.now() < end; await pause(100)) {
      const value = await evaluate(expression);
      if (value) return value;
      const problem = !despite && await evaluate('document.querySelector(".problem p")?.textContent');
      if (problem) throw new Error('the page says: ' + problem);
    }
    throw new Error(`waited in vain for ${expression}`);
  };
  const click = async (selector) => {
    await waitFor(`!!${find(selector)}`, 60000, true);
    const { x, y } = await evaluate(`(() => {
      const element = ${find(selector)};
      element.scrollIntoView({ block: 'center' });
      const box = element.getBoundingClientRect();
      return { x: box.x + box.width / 2, y: box.y + box.height / 2 };
    })()`);
    for (const type of ['mousePressed', 'mouseReleased']) {
      await send('Input.dispatchMouseEvent', { type, x, y, button: 'left', clickCount: 1 });
    }
  };
  const press = async (key, code) => {
    for (const type of ['keyDown', 'keyUp']) {
      await send('Input.dispatchKeyEvent', { type, key, code: key, windowsVirtualKeyCode: code });
    }
  };
  const type = async (selector, text) => {
    await click(selector);
    await send('Input.insertText', { text });
  };
  const choose = async (selector, files) => {
    await send('DOM.enable');
    const { root } = await send('DOM.getDocument');
    const { nodeId } = await send('DOM.querySelector', { nodeId: root.nodeId, selector });
    await send('DOM.setFileInputFiles', { nodeId, files });
  };
  const keep = async (name) => {
    if (!screenshots) return;
    const { data } = await send('Page.captureScreenshot', { format: 'png' });
    writeFileSync(join(screenshots, name + '.png'), Buffer.from(data, 'base64'));
  };
  const look = async (name) => {
    await pause(400);
    for (const scheme of ['light', 'dark']) {
      await send('Emulation.setEmulatedMedia', { features: [{ name: 'prefers-color-scheme', value: scheme }] });
      await pause(150);
      await keep(`${name}_${scheme}`);
    }
    await send('Emulation.setEmulatedMedia', { features: [] });
    await send('Emulation.setDeviceMetricsOverride', { width: 360, height: 740, deviceScaleFactor: 1, mobile: true });
    await pause(250);
    if (await evaluate('document.documentElement.scrollWidth') > 360) wide.push(name);
    await keep(`${name}_narrow`);
    await send('Emulation.clearDeviceMetricsOverride');
  };
  return { waitFor, click, press, type, choose, keep, look, wide };
};
