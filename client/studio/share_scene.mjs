// Colours photos and shares the scene in headless Chromium as a person would, and tells what was seen, as JSON on stdout.
//   node share_scene.mjs CHROMIUM ADDRESS OUT [SCREENSHOTS]
// ADDRESS: as `color3d studio FOLDER` printed it; OUT: what was saved, and sheet.pdf. wide: pages that are wider than a
// screen of 360 px. With a fourth argument pages leave PNGs there: light, dark and narrow.
import { readdirSync, statSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';

import { openPage } from '../../tests/support/page_hand.mjs';

const [chromium, address, out, screenshots] = process.argv.slice(2);
const { send, evaluate, waitFor, click, clickText, type, saveTo, savedAs, look, tell } =
    openPage(chromium, address, screenshots, { flags: ['--window-size=1280,900'] });

const share = async () => {
  await saveTo(out);
  await waitFor('!!document.querySelector("#go-on")');
  const name = await evaluate('document.querySelector("h1").textContent');
  await evaluate(`(async () => {
    const set = location.hash.split('/')[1];
    const body = JSON.stringify({ preset: 'fast', color: 'automatic' });
    const answer = await fetch('/api/sets/' + set + '/colorize', { method: 'POST', body });
    location.hash = 'job/' + (await answer.json()).id;
  })()`);
  await waitFor('!!document.querySelector("#share-title")', 300000);
  await type('#credit-colored_by', 'Erika Müller');
  await type('#credit-source', 'Stadtarchiv, 7');
  await type('#credit-licence', 'CC BY 4.0');
  await click('#caption');
  await clickText('Save the key photo');
  await savedAs('key_view_colored.png');
  await clickText('Save all photos in colour');
  await savedAs(`${name}_coloured.zip`);
  await click('[data-format=spz]');
  await waitFor('!!document.querySelector("a[download=\\"scene.spz\\"]")', 120000);
  await click('a[download="scene.spz"]');
  await savedAs('scene.spz');
  await evaluate('document.querySelector("#movie-length").value = "4"');
  await click('#make-movie');
  await waitFor('!!document.querySelector("a[download=\\"scene.mp4\\"]")', 240000);
  await click('a[download="scene.mp4"]');
  await savedAs('scene.mp4');
  await clickText('Save it beside grey');
  await savedAs('side_by_side.mp4');
  await evaluate('document.querySelector("#share-title").scrollIntoView()');
  await look('share');
  // The credit is there again.
  await send('Page.reload');
  await waitFor('document.querySelector("#credit-colored_by")?.value === "Erika Müller"');
  await click('#go-sheet');
  await waitFor('document.querySelector("#print")?.disabled === false', 240000);
  const failed = await evaluate('[...document.querySelectorAll(".sheet img")].filter((image) => !image.naturalWidth).length');
  const figures = await evaluate('document.querySelectorAll(".sheet figure").length');
  await look('sheet');
  const { data } = await send('Page.printToPDF', { preferCSSPageSize: true, printBackground: true });
  writeFileSync(join(out, 'sheet.pdf'), Buffer.from(data, 'base64'));
  return {
    failed, figures, pages: await evaluate('document.querySelectorAll(".sheet").length'),
    saved: Object.fromEntries(readdirSync(out).map((name) => [name, statSync(join(out, name)).size])),
  };
};

await tell(share);
