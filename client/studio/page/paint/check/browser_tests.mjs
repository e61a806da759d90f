// node browser_tests.mjs FOLDER [SHARED_DATA]: the painter in headless Chromium, with events of mouse, keyboard, pen
// and fingers as a user makes them. PAINT_SCREENSHOTS=DIR keeps pictures of it on a real photo of SHARED_DATA.
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { copyFileSync, existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';

import { openBrowser } from '../../../../../tests/support/browser.mjs';
import { Hand } from './hand.mjs';
import { looks } from './looks.mjs';
import { prepare, skip, sources } from './prepare.mjs';

const [folder, sharedData = ''] = process.argv.slice(2);
const chromium = ['chromium', 'chromium-browser', 'google-chrome']
  .find((program) => spawnSync(program, ['--version']).status === 0);
if (!chromium) skip('there is no Chromium');
const { bundle } = prepare(folder);
const out = join(folder, 'browser');
await bundle([join(sources, 'check', 'harness.ts')], out, { format: 'iife' });
for (const name of ['harness.html', 'harness.css']) copyFileSync(join(sources, 'check', name), join(out, 'check', name));

const browser = openBrowser(chromium, ['--window-size=1280,800', '--hide-scrollbars', '--force-color-profile=srgb']);
const hand = new Hand(browser);
const downloads = mkdtempSync(join(tmpdir(), 'color3d-paint-'));

// Tests in the order in which they are written; each begins with an empty painter on the drawn photo.
const cases = [];
const test = (name, run) => cases.push({ name, run });

test('a stroke of the mouse and a click are a line and a disc', async () => {
  const ends = await hand.drag([60, 50], [160, 110]);
  const click = await hand.click(200, 250);
  const [line, disc] = await hand.strokes();
  assert.deepEqual(line, { line: ends, width: 7, color: '#b5654a' });
  assert.deepEqual(disc, { x: click[0], y: click[1], radius: 3.5, color: '#b5654a' });
  assert.equal(await browser.evaluate('harness.bytes()'),
    `[\n{"line": [[${ends[0].join(', ')}], [${ends[1].join(', ')}]], "width": 7, "color": "#b5654a"},\n` +
    `{"x": ${click[0]}, "y": ${click[1]}, "radius": 3.5, "color": "#b5654a"}\n]\n`);
  assert.equal(await browser.evaluate('harness.heard.changes'), 2);
});

test('undo and redo by keys and buttons go through all states', async () => {
  const states = [await hand.bytes()];
  for (let i = 0; i < 6; ++i) {
    await hand.drag([40, 40 + 30 * i], [120, 40 + 30 * i]);
    states.push(await hand.bytes());
  }
  await hand.key('e');
  await hand.drag([80, 20], [80, 280]);
  states.push(await hand.bytes());
  assert.equal(new Set(states).size, 8);
  for (let i = 6; i >= 0; --i) {
    if (i % 2) await hand.key('z', ['ctrl']);
    else await hand.press('Undo');
    assert.equal(await hand.bytes(), states[i]);
  }
  await hand.key('z', ['ctrl']);
  for (let i = 1; i < 8; ++i) {
    if (i % 2) await hand.key('z', ['ctrl', 'shift']);
    else await hand.press('Redo');
    assert.equal(await hand.bytes(), states[i]);
  }
});

test('wheel, keys and buttons zoom, middle button and space move the photo', async () => {
  const before = await hand.view();
  const [x, y] = (await hand.screen([300, 100])).map(Math.round);
  const under = await hand.photo([x, y]);
  await hand.wheel(x, y, -240);
  const near = await hand.view();
  assert.ok(near.scale > 1.5 * before.scale);
  assert.deepEqual(await hand.photo([x, y]), under);
  await hand.dragScreen([x, y], [x - 50, y + 30], { button: 'middle' });
  const moved = await hand.view();
  assert.deepEqual([moved.x - near.x, moved.y - near.y].map(Math.round), [-50, 30]);
  await hand.holding(' ', () => hand.dragScreen([x, y], [x + 20, y], {}));
  assert.equal(Math.round((await hand.view()).x - moved.x), 20);
  await hand.key('+');
  assert.ok((await hand.view()).scale > 1.2 * moved.scale);
  await hand.key('-');
  await hand.press('Zoom out');
  assert.ok((await hand.view()).scale < moved.scale);
  await hand.key('1');
  assert.equal((await hand.view()).scale, 1);
  const ends = await hand.drag([60, 50], [160, 110]); // places are right at any zoom
  assert.deepEqual((await hand.strokes()).map(({ line }) => line), [ends]);
  await hand.key('0');
  assert.deepEqual(await hand.view(), before);
});

test('lines are straight, and Shift holds their angle', async () => {
  await hand.key('l');
  const ends = await hand.drag([50, 60], [150, 200]);
  await hand.drag([50, 100], [150, 104], { modifiers: ['shift'] });
  const [free, held] = await hand.strokes();
  assert.deepEqual(free.line, ends);
  assert.equal(held.line[0][1], held.line[1][1]);
});

test('the size is set by keys and slider', async () => {
  await hand.key(']');
  const wider = (await hand.strokesOf(() => hand.click(50, 50))).at(-1).radius;
  assert.ok(wider > 3.5);
  await hand.focus('.paint-slider input');
  for (let i = 0; i < 10; ++i) await hand.key('ArrowRight');
  assert.ok((await hand.strokesOf(() => hand.click(150, 50))).at(-1).radius > 1.3 * wider);
});

test('a region grows up to the edge, and a drag changes its reach', async () => {
  await hand.key('r');
  await hand.click(280, 150);
  const [entry] = await hand.strokes();
  assert.deepEqual(Object.keys(entry), ['region', 'color']);
  const { inside, outside } = await browser.evaluate('harness.inDisc(0)');
  const area = Math.PI * 60 * 60;
  assert.ok(inside > 0.9 * area && outside < 0.002 * area, `${inside} inside, ${outside} outside of ${area}`);
  await hand.key('z', ['ctrl']);
  await hand.drag([280, 150], [170, 150]);
  assert.equal((await browser.evaluate('harness.inDisc(0)')).outside, 0);
});

test('colours are picked from strokes, layers and the photo', async () => {
  await hand.click(60, 60);
  await hand.type('.paint-code input', '#3366cc');
  await hand.click(120, 60);
  await hand.key('i');
  await hand.click(60, 60);
  await hand.key('b');
  await hand.click(180, 60);
  const stay = await hand.screen([120, 60]);
  await hand.dragScreen(stay, stay, { modifiers: ['alt'] }); // picks for once
  await hand.click(240, 60);
  assert.deepEqual((await hand.strokes()).map(({ color }) => color), ['#b5654a', '#3366cc', '#b5654a', '#3366cc']);
  await browser.evaluate('harness.automatic("#228833")');
  await hand.key('i');
  await hand.choose('Pick from', 'automatic');
  await hand.click(300, 250);
  assert.equal(await hand.value('.paint-code input'), '#228833');
  await hand.choose('Pick from', 'photo');
  await hand.click(280, 150);
  const [, gray] = /^#(..)\1\1$/.exec(await hand.value('.paint-code input')) ?? [];
  assert.ok(parseInt(gray, 16) >= 170 && parseInt(gray, 16) < 180, gray);
  await hand.choose('Pick from', 'seen');
  await hand.click(10, 290);
  assert.equal(await hand.value('.paint-code input'), '#228833'); // the automatic layer is what is seen
});

test('wheel of colours, sliders, palette and recent colours set the colour', async () => {
  const at = async (selector, x, y) => {
    const box = await hand.box(selector);
    await hand.clickScreen(box.x + x * box.width, box.y + y * box.height);
    return hand.value('.paint-code input');
  };
  const red = await at('.paint-wheel', 0.7, 0.45), blue = await at('.paint-wheel', 0.45, 0.72);
  assert.match(red, /^#[89a-f].[0-7].[0-9].$/);
  assert.ok(parseInt(blue.slice(5), 16) > parseInt(blue.slice(1, 3), 16));
  await hand.focus('.paint-chroma input');
  await hand.key('Home');
  const [, first] = /^#(..)\1\1$/.exec(await hand.value('.paint-code input')) ?? [];
  assert.ok(first, 'no strength is grey');
  await hand.press('Sky, #86b2d9');
  await hand.click(50, 50);
  await hand.press('Keep grey');
  await hand.click(90, 50);
  await hand.press('Colour #86b2d9');
  await hand.click(130, 50);
  assert.deepEqual((await hand.strokes()).map(({ color, keep }) => color ?? keep), ['#86b2d9', 'neutral', '#86b2d9']);
  await hand.press('From a list');
  await hand.type('.paint-list textarea', '#102030 #405060, fff');
  await hand.press('Use these colours');
  const colors = await browser.evaluate(
    '[...document.querySelectorAll(".paint-palette .paint-swatch")].map((e) => e.dataset.color)');
  assert.deepEqual(colors, ['#102030', '#405060', '#ffffff']);
});

test('strokes are saved as the bytes of the format, and opened again', async () => {
  await browser.send('Browser.setDownloadBehavior', { behavior: 'allow', downloadPath: downloads });
  await hand.drag([60, 50], [160, 110]);
  await hand.key('r');
  await hand.click(280, 150);
  const saved = join(downloads, 'strokes.json');
  await hand.press('Save strokes');
  await hand.until(() => existsSync(saved) && readFileSync(saved, 'utf8').endsWith(']\n'));
  const bytes = readFileSync(saved, 'utf8');
  assert.equal(bytes, await hand.bytes());
  await hand.press('Remove all strokes');
  assert.equal(await hand.bytes(), '[]\n');
  await hand.giveFile(saved);
  await hand.until(async () => (await hand.bytes()) === bytes);
  await hand.key('z', ['ctrl']);
  assert.equal(await hand.bytes(), '[]\n');
  const bad = join(downloads, 'bad.json');
  writeFileSync(bad, '[{"x": 500, "y": 3, "color": "#000000"}]');
  await hand.giveFile(bad);
  await hand.until(async () => (await hand.text('[role=status]')).includes('bad.json: colour hint 0 at (500, 3)'));
  assert.equal(await hand.bytes(), '[]\n');
  const fixture = readFileSync(join(sources, 'fixtures', 'strokes.json'), 'utf8');
  await browser.evaluate(`harness.load(${JSON.stringify(fixture)})`);
  assert.equal(await hand.bytes(), fixture);
});

test('fingers paint, zoom and move', async () => {
  const ends = await hand.touchDrag([[60, 80]], [[180, 200]]);
  assert.deepEqual((await hand.strokes()).map(({ line }) => line), [ends]);
  const before = await hand.view();
  await hand.touchDrag([[180, 150], [220, 150]], [[140, 150], [260, 150]]);
  const after = await hand.view();
  assert.ok(after.scale > 2 * before.scale, `${before.scale} ${after.scale}`);
  assert.equal((await hand.strokes()).length, 1);
});

test('a pen draws as wide as it is pressed', async () => {
  const [x0, y0] = await hand.screen([50, 50]);
  await hand.pen(Array.from({ length: 30 }, (_, i) => [x0 + 8 * i, y0 + 2 * i, (i + 1) / 30]));
  const widths = (await hand.strokes()).map(({ width }) => width);
  assert.ok(widths.length > 2 && widths.length < 10, String(widths));
  assert.deepEqual(widths, [...widths].sort((a, b) => a - b));
});

test('all can be done by keys', async () => {
  await hand.focus('canvas');
  for (let i = 0; i < 4; ++i) await hand.key('ArrowLeft');
  await hand.key('Enter');
  for (let i = 0; i < 5; ++i) await hand.key('ArrowDown');
  await hand.key('Enter');
  const [{ line }] = await hand.strokes();
  assert.equal(line[0][0], line[1][0]);
  const { scale } = await hand.view();
  assert.ok(Math.abs(line[1][1] - line[0][1] - 60 / scale) < 0.11);
  await hand.key('r');
  for (let i = 0; i < 16; ++i) await hand.key('ArrowRight');
  await hand.key('Enter');
  assert.equal((await hand.strokes()).length, 2);
  await hand.key('?', ['shift']);
  assert.ok(await browser.evaluate('document.querySelector("dialog").open'));
  await hand.key('Escape');
  assert.ok(!await browser.evaluate('document.querySelector("dialog").open'));
});

test('the preview follows, and is withdrawn when strokes come', async () => {
  await browser.evaluate('harness.mount({ preview: true })');
  const state = () => browser.evaluate('document.querySelector(".paint").dataset.preview');
  const pixel = () => hand.pixel([100, 150]);
  const gray = await pixel();
  for (let i = 0; i < 4; ++i) await hand.drag([80, 60 + 30 * i], [150, 60 + 30 * i]);
  await hand.until(async () => (await state()) === 'shown');
  const { asked, aborted, sides } = await browser.evaluate('harness.heard');
  assert.ok(asked >= 1 && asked <= 4 && aborted < asked, `${asked} asked, ${aborted} aborted`);
  assert.equal(sides[0], 400); // the photo is smaller than a preview may be
  const colored = await hand.pixel([100, 165]);
  assert.ok(Math.abs(gray[0] - gray[2]) < 3 && colored[0] > colored[2] + 15, `${gray} ${colored}`);
  await hand.press('Remove all strokes');
  await hand.until(async () => (await state()) === 'none');
});

test('what is painted looks like its colour in the light of the photo', async () => {
  await hand.drag([40, 150], [160, 150]);
  const [r, , b] = await hand.pixel([100, 150]);
  assert.ok(r > b + 20);
  await hand.key('c');
  const gray = await hand.pixel([100, 150]);
  assert.ok(Math.max(...gray.slice(0, 3)) - Math.min(...gray.slice(0, 3)) < 3);
  await hand.drag([40, 100], [160, 100]); // who paints sees it
  assert.equal(await browser.evaluate('document.querySelector("[aria-label=\\"Show photo only\\"]").ariaPressed'), 'false');
  await hand.press('Sky, #86b2d9');
  await hand.click(200, 40);
  await hand.key('x');
  await hand.click(240, 40);
  assert.deepEqual((await hand.strokes()).slice(2).map(({ color }) => color), ['#86b2d9', '#b5654a']);
});

test('every control has a name, and one can walk through all of them', async () => {
  await browser.evaluate('harness.automatic("#228833")');
  await hand.drag([60, 50], [160, 110]);
  const { nodes } = await browser.send('Accessibility.getFullAXTree');
  const roles = ['button', 'slider', 'textbox', 'checkbox', 'combobox', 'application', 'toolbar'];
  const controls = nodes.filter(({ ignored, role }) => !ignored && roles.includes(role?.value));
  assert.ok(controls.length > 40);
  for (const { role, name } of controls) assert.ok(name?.value?.trim(), `a ${role.value} without a name`);
  const order = await hand.tabOrder(60);
  const first = (text) => order.findIndex((name) => name.includes(text));
  assert.ok(first('Undo') < first('Brush') && first('Brush') < first('Photo to colour') &&
    first('Photo to colour') < first('Hue') && first('Hue') < first('Opacity of Strokes'), order.join(' | '));
});

test('nothing breaks at 360 px with long words, and texts have contrast', async () => {
  for (const [width, height] of [[360, 740], [320, 640], [1280, 800]]) {
    for (const scheme of ['light', 'dark']) {
      await hand.window(width, height, scheme);
      await browser.evaluate('harness.mount({ language: "german", preview: true })');
      await browser.evaluate('harness.automatic("#228833")');
      for (const problem of await browser.evaluate(`(${looks})()`)) {
        assert.fail(`${width} px, ${scheme}: ${problem}`);
      }
    }
  }
  await hand.window(360, 740, 'light', true);
  await browser.evaluate('harness.mount()');
  const before = await hand.box('.paint-stage');
  await hand.tap('.paint-opener');
  const after = await hand.box('.paint-stage');
  assert.ok(after.height > before.height + 150, 'without the colours there is more of the photo');
  await hand.tap('.paint-opener');
  await hand.tap('[data-tool=line]');
  const ends = await hand.touchDrag([[100, 80]], [[300, 200]]);
  assert.deepEqual((await hand.strokes()).map(({ line }) => line), [ends]);
  await hand.window(1280, 800, 'light');
});

test('thousands of strokes stay quick', async () => {
  const strokes = Array.from({ length: 4000 }, (_, i) => ({
    line: Array.from({ length: 20 }, (_, k) => [(i * 7 + 5 * k) % 400, (i * 13 + 3 * ((k * k) % 17)) % 300]),
    width: 3, color: '#' + ((i * 4099) % 0xffffff).toString(16).padStart(6, '0'),
  }));
  await browser.evaluate(`harness.load(${JSON.stringify(JSON.stringify(strokes))})`);
  await hand.frame();
  const ms = async (action) => {
    const began = Date.now();
    await action();
    return Date.now() - began;
  };
  const stroke = await ms(() => hand.drag([40, 40], [300, 200]));
  const undo = await ms(() => hand.key('z', ['ctrl']));
  const wheel = await ms(() => hand.wheel(400, 300, -120));
  console.log(`  with 4000 strokes: a stroke of 10 events ${stroke} ms, undo ${undo} ms, zoom ${wheel} ms`);
  assert.ok(stroke < 3000 && undo < 1500 && wheel < 1500);
});

test('destroy leaves nothing', async () => {
  assert.equal(await browser.evaluate('harness.destroy()'), 0);
});

const banana = join(sharedData, 'scenes', 'banana', 'images', 'DSC_0431.jpg');
const screenshots = process.env.PAINT_SCREENSHOTS;
if (existsSync(banana)) {
  test('a real photo is coloured', async () => {
    const { onRealPhoto } = await import('./real_photo.mjs');
    if (screenshots) mkdirSync(screenshots, { recursive: true });
    await onRealPhoto(browser, hand, readFileSync(banana).toString('base64'), screenshots);
  });
}

let failed = 0;
const wanted = process.env.PAINT_CASE ?? '';
try {
  await browser.open();
  await hand.window(1280, 800, 'light');
  await browser.send('Page.navigate', { url: pathToFileURL(join(out, 'check', 'harness.html')).href });
  await hand.until(() => browser.evaluate('"harness" in window'));
  for (const { name, run } of cases.filter((one) => one.name.includes(wanted))) {
    const began = Date.now();
    try {
      await browser.evaluate('harness.mount()');
      await browser.evaluate('Object.assign(harness.heard, { changes: 0, asked: 0, aborted: 0, sides: [] })');
      await run();
      assert.deepEqual(browser.errors, []);
      assert.deepEqual(browser.requests, []);
      console.log(`ok: ${name} (${Date.now() - began} ms)`);
    } catch (error) {
      ++failed;
      browser.errors.length = 0;
      console.log(`FAILED: ${name}\n${error.stack}`);
    }
  }
} finally {
  await browser.close();
  rmSync(downloads, { recursive: true, force: true });
}
process.exit(failed ? 1 : 0);
