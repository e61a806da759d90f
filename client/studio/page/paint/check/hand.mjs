// A user's hand in the browser: events of mouse, keys, pen and fingers. Places are px of the photo; those of
// ...Screen and of wheel, pen, box are CSS px of the page.
import { pause } from '../../../../../tests/support/browser.mjs';

const bits = { alt: 1, ctrl: 2, meta: 4, shift: 8 };
const bitsOf = (modifiers = []) => modifiers.reduce((sum, name) => sum | bits[name], 0);
const rounded = (value) => Math.round(value * 10) / 10;
const steps = 8;
const buttonBits = { left: 1, right: 2, middle: 4 };

export class Hand {
  constructor(browser) {
    this.browser = browser;
  }
  evaluate(expression) {
    return this.browser.evaluate(expression);
  }
  async until(condition, ms = 10000) {
    for (const end = Date.now() + ms; Date.now() < end; await pause(20)) if (await condition()) return;
    throw new Error(`waited in vain for ${condition}`);
  }
  async frame() {
    await this.evaluate('new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))');
  }
  async window(width, height, scheme, isPhone = false) {
    await this.browser.send('Emulation.setDeviceMetricsOverride',
      { width, height, deviceScaleFactor: isPhone ? 2 : 1, mobile: isPhone });
    await this.browser.send('Emulation.setTouchEmulationEnabled', { enabled: isPhone });
    await this.browser.send('Emulation.setEmulatedMedia',
      { features: [{ name: 'prefers-color-scheme', value: scheme }] });
    await this.frame();
  }

  // What the page shows.
  bytes() {
    return this.evaluate('harness.bytes()');
  }
  async strokes() {
    return JSON.parse(await this.bytes());
  }
  async strokesOf(action) {
    await action();
    return this.strokes();
  }
  async view() {
    const { scale, x, y } = await this.evaluate('({...document.querySelector(".paint").dataset})');
    return { scale: Number(scale), x: Number(x), y: Number(y) };
  }
  box(selector) {
    return this.evaluate(`(() => { const e = document.querySelector(${JSON.stringify(selector)});
      e.scrollIntoView({ block: 'nearest' });
      const { x, y, width, height } = e.getBoundingClientRect(); return { x, y, width, height }; })()`);
  }
  value(selector) {
    return this.evaluate(`document.querySelector(${JSON.stringify(selector)}).value`);
  }
  text(selector) {
    return this.evaluate(`document.querySelector(${JSON.stringify(selector)}).textContent`);
  }
  async screen([x, y]) {
    const view = await this.view(), box = await this.box('.paint-stage canvas');
    return [box.x + view.x + view.scale * x, box.y + view.y + view.scale * y];
  }
  // Where a whole px of the page lies on the photo, as strokes have it.
  async photo([x, y]) {
    const view = await this.view(), box = await this.box('.paint-stage canvas');
    return [rounded((x - box.x - view.x) / view.scale), rounded((y - box.y - view.y) / view.scale)];
  }
  async pixel(place) {
    await this.frame();
    const [x, y] = await this.screen(place);
    const box = await this.box('.paint-stage canvas');
    return this.evaluate(`[...document.querySelector('.paint-stage canvas').getContext('2d')
      .getImageData(${Math.round(x - box.x)}, ${Math.round(y - box.y)}, 1, 1).data]`);
  }

  // The mouse.
  mouse(type, x, y, more = {}) {
    return this.browser.send('Input.dispatchMouseEvent', { type, x, y, ...more });
  }
  async dragScreen(from, to, { button = 'left', modifiers, by = [] } = {}) {
    const held = { button, buttons: buttonBits[button], modifiers: bitsOf(modifiers) };
    await this.mouse('mouseMoved', ...from, { modifiers: bitsOf(modifiers) });
    await this.mouse('mousePressed', ...from, { ...held, clickCount: 1 });
    let last = from;
    for (const place of from === to ? [] : [...by, to]) {
      for (let i = 1; i <= steps; ++i) {
        await this.mouse('mouseMoved', last[0] + ((place[0] - last[0]) * i) / steps,
          last[1] + ((place[1] - last[1]) * i) / steps, held);
      }
      last = place;
    }
    await this.mouse('mouseReleased', ...to, { button, buttons: 0, modifiers: bitsOf(modifiers), clickCount: 1 });
    await this.frame();
  }
  // Returns the ends as strokes have them.
  async drag(from, to, options = {}) {
    const places = await Promise.all([from, to, ...(options.by ?? [])].map((place) => this.screen(place)));
    const [start, end, ...by] = places.map((place) => place.map(Math.round));
    await this.dragScreen(start, end, { ...options, by });
    return [await this.photo(start), await this.photo(end)];
  }
  async click(x, y) {
    const place = (await this.screen([x, y])).map(Math.round);
    await this.dragScreen(place, place);
    return this.photo(place);
  }
  async clickScreen(x, y) {
    const place = [Math.round(x), Math.round(y)];
    await this.dragScreen(place, place);
  }
  async wheel(x, y, deltaY) {
    await this.mouse('mouseWheel', x, y, { deltaX: 0, deltaY });
    await this.frame();
  }
  async pen(places) {
    const of = (pressure) => ({ button: 'left', buttons: 1, pointerType: 'pen', force: pressure });
    const [[x, y, first]] = places;
    await this.mouse('mousePressed', x, y, { ...of(first), clickCount: 1 });
    for (const [px, py, pressure] of places.slice(1)) await this.mouse('mouseMoved', px, py, of(pressure));
    const [lx, ly] = places.at(-1);
    await this.mouse('mouseReleased', lx, ly, { button: 'left', pointerType: 'pen', clickCount: 1 });
    await this.frame();
  }
  // Presses the button of this name.
  async press(name) {
    const box = await this.evaluate(`(() => {
      const all = [...document.querySelectorAll('.paint button')].filter((e) => e.offsetParent);
      const name = (e) => e.getAttribute('aria-label') ?? e.textContent;
      const found = all.find((e) => name(e) === ${JSON.stringify(name)}) ??
        all.find((e) => name(e).includes(${JSON.stringify(name)}));
      if (!found) return null;
      found.scrollIntoView({ block: 'nearest' });
      const { x, y, width, height } = found.getBoundingClientRect();
      return { x, y, width, height }; })()`);
    if (!box) throw new Error(`there is no button "${name}"`);
    await this.clickScreen(box.x + box.width / 2, box.y + box.height / 2);
  }

  // Fingers: all go evenly from their first place to their last. Returns the ends of the first.
  async touchDrag(from, to) {
    const starts = (await Promise.all(from.map((place) => this.screen(place)))).map((p) => p.map(Math.round));
    const ends = (await Promise.all(to.map((place) => this.screen(place)))).map((p) => p.map(Math.round));
    const result = [await this.photo(starts[0]), await this.photo(ends[0])];
    const touch = (type, touchPoints) => this.browser.send('Input.dispatchTouchEvent', { type, touchPoints });
    const at = (share) => starts.map(([x, y], id) =>
      ({ id, x: x + (ends[id][0] - x) * share, y: y + (ends[id][1] - y) * share }));
    for (let n = 1; n <= starts.length; ++n) await touch('touchStart', at(0).slice(0, n));
    for (let i = 1; i <= steps; ++i) await touch('touchMove', at(i / steps));
    await touch('touchEnd', []);
    await this.frame();
    return result;
  }

  async tap(selector) {
    const { x, y, width, height } = await this.box(selector);
    const touch = (type, touchPoints) => this.browser.send('Input.dispatchTouchEvent', { type, touchPoints });
    await touch('touchStart', [{ id: 0, x: x + width / 2, y: y + height / 2 }]);
    await touch('touchEnd', []);
    await this.frame();
  }

  // Keys.
  async keyEvent(type, key, modifiers) {
    const code = { ' ': 32, Enter: 13, Escape: 27, Tab: 9, Home: 36, ArrowLeft: 37, ArrowUp: 38, ArrowRight: 39,
      ArrowDown: 40 }[key] ?? key.toUpperCase().charCodeAt(0);
    await this.browser.send('Input.dispatchKeyEvent', {
      type, key: modifiers.includes('shift') && /^[a-z]$/.test(key) ? key.toUpperCase() : key,
      windowsVirtualKeyCode: code, modifiers: bitsOf(modifiers), text: type === 'keyDown' && key === 'Enter' ? '\r' : undefined,
    });
  }
  async key(key, modifiers = []) {
    await this.keyEvent('keyDown', key, modifiers);
    await this.keyEvent('keyUp', key, modifiers);
    await this.frame();
  }
  async holding(key, action) {
    await this.keyEvent('keyDown', key, []);
    await action();
    await this.keyEvent('keyUp', key, []);
  }
  async focus(selector) {
    await this.evaluate(`[...document.querySelectorAll(${JSON.stringify(selector)})].find((e) => e.offsetParent).focus()`);
  }
  // Writes into a field, and leaves it.
  async type(selector, text) {
    await this.evaluate(`document.querySelector(${JSON.stringify(selector)}).select()`);
    await this.browser.send('Input.insertText', { text });
    await this.key('Tab');
  }
  async choose(label, value) {
    await this.evaluate(`(() => {
      const row = [...document.querySelectorAll('.paint-select')].find((e) => e.textContent.includes(${JSON.stringify(label)}));
      const list = row.querySelector('select');
      list.value = ${JSON.stringify(value)};
      list.dispatchEvent(new Event('change', { bubbles: true })); })()`);
  }
  async giveFile(file) {
    const { root } = await this.browser.send('DOM.getDocument');
    const { nodeId } = await this.browser.send('DOM.querySelector', { nodeId: root.nodeId, selector: '.paint > input[type=file]' });
    await this.browser.send('DOM.setFileInputFiles', { nodeId, files: [file] });
  }
  // Names of what has the focus, from the first control on.
  async tabOrder(count) {
    await this.focus('.paint button');
    const order = [];
    for (let i = 0; i < count; ++i) {
      order.push(await this.evaluate(`(() => { const e = document.activeElement;
        return e.getAttribute('aria-label') ?? (e.labels?.[0] ?? e).textContent; })()`));
      await this.key('Tab');
    }
    return order;
  }
}
