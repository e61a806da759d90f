// Several scenes in the studio's queue, in headless Chromium; tells what was seen, as JSON on stdout.
//   node order_queue.mjs CHROMIUM ADDRESS FOLDER [SCREENSHOTS]
// ADDRESS: as `color3d studio` printed it; FOLDER: photos, brought four times under other names, each time
// without another one, as the service calls equal files one scene. before, after: names
// in the queue before and after the last scene was put first; moved: where a page of a moved run ended; left: names
// after a cancel; again: names after browser and studio page were closed and opened again.
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';

import { pause } from '../../tests/support/browser.mjs';
import { openPage } from '../../tests/support/page_hand.mjs';

const [chromium, address, folder, screenshots] = process.argv.slice(2);
const { send, evaluate, origin, waitFor, click, look, tell } =
    openPage(chromium, address, screenshots, { flags: ['--window-size=1280,900'] });

const files = readdirSync(folder, { recursive: true, withFileTypes: true }).filter((entry) => entry.isFile())
  .map((entry) => [join(entry.parentPath ?? entry.path, entry.name)])
  .map(([path]) => [path.slice(folder.length + 1), readFileSync(path).toString('base64')]);

// Brings the folder without its photo `left_out` as set `name`, and starts a run. Returns its ID.
const start = (name, left_out) => evaluate(`(async () => {
  const call = async (path, body) => (await fetch(path, { method: 'POST', body })).json();
  const set = (await call('/api/sets', JSON.stringify({ name: ${JSON.stringify(name)} }))).id;
  for (const [path, base64] of ${JSON.stringify(files.filter(([path]) => path !== left_out))}) {
    const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    await call('/api/sets/' + set + '/files?name=' + encodeURIComponent(path), bytes);
  }
  return (await call('/api/sets/' + set + '/colorize', JSON.stringify({ preset: 'fast', color: 'automatic' }))).id;
})()`);
const names = () => evaluate('[...document.querySelectorAll(".queue-item .queue-name")].map((name) => name.textContent)');
const button = (text) => `//button[@aria-label="${text}"]`;

const use = async () => {
  await waitFor('!!document.querySelector(".drop-area")');
  const runs = [];
  const photos = files.map(([path]) => path).filter((path) => /\.(png|jpg)$/.test(path)).sort();
  for (const [i, name] of ['one', 'two', 'three', 'four'].entries()) runs.push(await start(name, photos[i + 1]));
  await waitFor('document.querySelectorAll(".queue-item").length === 4');
  await waitFor('!!document.querySelector(".queue-item .state-running")');
  await waitFor('![...document.querySelectorAll(".queue-name")].some((name) => name.textContent.startsWith("Scene "))');
  const before = await names();
  await look('queue');
  await click(button('First: four'));
  await waitFor('document.querySelectorAll(".queue-item .queue-name")[1]?.textContent === "four"');
  const after = await names();
  await send('Page.navigate', { url: `${origin}/#job/${runs[3]}` });
  await waitFor(`location.hash.startsWith("#job/") && !location.hash.endsWith("${runs[3]}")`, 60000, { despite: true });
  const moved = await evaluate('location.hash');
  // The browser's page goes away while a run goes on.
  await send('Page.navigate', { url: 'about:blank' });
  await pause(1000);
  await send('Page.navigate', { url: `${origin}/` });
  await waitFor('document.querySelectorAll(".queue-item").length >= 3');
  await click(button('Cancel: two'));
  await waitFor('![...document.querySelectorAll(".queue-name")].some((name) => name.textContent === "two")');
  const left = await names();
  return { before, after, moved: moved !== `#job/${runs[3]}`, left };
};

await tell(use);
