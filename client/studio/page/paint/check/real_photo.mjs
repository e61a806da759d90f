// The painter on a photo: three strokes and a region, at the sizes of a desk and of a phone, light and dark. Leaves
// screenshots where a folder is given.
import assert from 'node:assert/strict';
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';

export const onRealPhoto = async (browser, hand, photo, screenshots) => {
  const shot = async (name) => {
    await hand.frame();
    if (!screenshots) return;
    const { data } = await browser.send('Page.captureScreenshot', { format: 'png' });
    writeFileSync(join(screenshots, name + '.png'), Buffer.from(data, 'base64'));
  };
  const mount = (language) => browser.evaluate(
    `harness.mount({ photo: ${JSON.stringify(photo)}, preview: true, language: ${JSON.stringify(language ?? null)} })`);
  // Shares of the photo's sides.
  const size = await (async () => {
    await mount();
    return browser.evaluate(`(() => { const v = document.querySelector('.paint').dataset;
      const c = document.querySelector('.paint-stage canvas').getBoundingClientRect();
      return { width: Math.round((c.width - 2 * v.x) / v.scale), height: Math.round((c.height - 2 * v.y) / v.scale) }; })()`);
  })();
  const at = (x, y) => [x * size.width, y * size.height];

  await shot('desk-empty');
  await hand.drag(at(0.1, 0.85), at(0.4, 0.9));
  await hand.press('Grass, #87a94f');
  await hand.drag(at(0.55, 0.1), at(0.9, 0.15), { by: [at(0.7, 0.05)] });
  await hand.type('.paint-code input', '#e0bb35');
  await hand.key('r');
  const began = Date.now();
  await hand.click(...at(0.5, 0.5));
  const grown = Date.now() - began;
  await hand.until(() => browser.evaluate('document.querySelector(".paint").dataset.preview === "shown"'));
  const strokes = await hand.strokes();
  assert.ok(strokes.length >= 3 && strokes.some((entry) => 'region' in entry), JSON.stringify(strokes).slice(0, 300));
  console.log(`  photo ${size.width}x${size.height}: region in ${grown} ms, ` +
    `${strokes.filter((entry) => 'region' in entry).map(({ region }) => region.length)} points`);
  const bytes = await hand.bytes();
  await shot('desk-painted');
  const box = await hand.box('[data-layer=preview] input');
  await hand.clickScreen(box.x + box.width / 2, box.y + box.height / 2);
  await shot('desk-strokes');
  await hand.window(1280, 800, 'dark');
  await shot('desk-dark');
  await hand.key('?', ['shift']);
  await shot('desk-shortcuts');
  await hand.key('Escape');
  for (const scheme of ['light', 'dark']) {
    await hand.window(360, 740, scheme, true);
    await mount(scheme === 'dark' ? 'german' : undefined);
    await browser.evaluate(`harness.load(${JSON.stringify(bytes)})`);
    await hand.touchDrag([at(0.3, 0.3)], [at(0.6, 0.35)]);
    assert.equal((await hand.strokes()).length, strokes.length + 1);
    await hand.until(() => browser.evaluate('document.querySelector(".paint").dataset.preview === "shown"'));
    await shot(`phone-${scheme}`);
  }
  await hand.window(1280, 800, 'light');
};
