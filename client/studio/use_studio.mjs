// Uses the studio in headless Chromium as a person would, and tells what was seen, as JSON on stdout.
//   node use_studio.mjs CHROMIUM ADDRESS FOLDER [SCREENSHOTS]
// ADDRESS: as `color3d studio` printed it; FOLDER: photos to choose. errors: of the console; requests: beyond
// the studio; texts: of the pages; wide: pages that are wider than a screen of 360 px; faint: texts with a
// contrast below 4.5; shades: whether the page of the finished scene is ready. With a fourth argument every page leaves a
// PNG there, wide, dark and narrow.
import { pause } from '../../tests/support/browser.mjs';
import { drawnBySoftware, openPage } from '../../tests/support/page_hand.mjs';

const [chromium, address, folder, screenshots] = process.argv.slice(2);
const { send, evaluate, origin, waitFor, click, press, choose, look, tell } =
    openPage(chromium, address, screenshots, { flags: [...drawnBySoftware, '--window-size=1280,900'] });

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

const use = async () => {
  await waitFor('!!document.querySelector(".drop-area")');
  await look('home');

  await choose('#choose-folder', folder);
  await waitFor('location.hash.startsWith("#set/") && !!document.querySelector("#go-on")');
  await waitFor('!!document.querySelector(".plan")');
  await look('photos');

  // By keyboard alone.
  await evaluate('document.querySelector("#go-on").focus()');
  await press('Enter');
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
  const shades = await stateOfScene(90000) === 'ready';
  await look('done');
  return { shades };
};

await tell(use);
