// Measures how long the preview of a stroke takes in the studio, with a real mouse in headless Chromium:
//   node measure_preview.mjs CHROMIUM ADDRESS [STROKES] [SCREENSHOTS]
// ADDRESS: as `color3d studio PHOTOS --no-open` printed it. Prints as JSON, for each choice of colours below the strokes, the
// median, 90th percentile and maximum of the times, ms, from the end of the stroke to the picture in the page.
import { pause } from '../../tests/support/browser.mjs';
import { openPage } from '../../tests/support/page_hand.mjs';

const [chromium, address, count = '20', screenshots] = process.argv.slice(2);
const { evaluate, waitFor, click, drag, keep, tell } = openPage(chromium, address, screenshots, {
  flags: ['--window-size=1400,1000', '--force-color-profile=srgb'], limit: 120000, every: 10,
});

// A stroke between two places, shares of the canvas that shows the photo.
const stroke = async (from, to) => {
  const box = await evaluate(`(() => { const c = document.querySelector('.paint-stage canvas');
    c.scrollIntoView({ block: 'center' });
    const b = c.getBoundingClientRect(), d = document.querySelector('.paint').dataset;
    return { left: b.x + Number(d.x), top: b.y + Number(d.y), width: b.width - 2 * d.x, height: b.height - 2 * d.y }; })()`);
  const at = ([x, y]) => [Math.round(box.left + x * box.width), Math.round(box.top + y * box.height)];
  await drag(at(from), at(to), 6);
};

const measure = async (below) => {
  await evaluate(`document.querySelector('input[value=${below}]').click()`);
  if (below !== 'nothing') await waitFor('document.querySelector("#told").textContent === ""');
  await pause(500);
  const times = [];
  for (let i = 0; i <= Number(count); ++i) { // the first one starts the service's worker
    const y = 0.06 + (0.88 * ((i * 7) % 21)) / 21, x = 0.1 + 0.7 * ((i * 0.618) % 1);
    await evaluate('delete document.querySelector(".paint").dataset.previewMs');
    await stroke([x, y], [x + 0.06, y + 0.03]);
    await waitFor('document.querySelector(".paint").dataset.previewMs && document.querySelector(".paint").dataset.preview === "shown"');
    const ms = Number(await evaluate('document.querySelector(".paint").dataset.previewMs'));
    if (i > 0) times.push(ms);
    await pause(60);
    if ([0, 3, Number(count)].includes(i)) await keep(`${below}_${i}`);
  }
  times.sort((a, b) => a - b);
  const at = (share) => times[Math.min(times.length - 1, Math.floor(share * times.length))];
  return { median: at(0.5), ninety_percent: at(0.9), longest: times.at(-1), count: times.length };
};

await tell(async () => {
  const set = /page=set\/([0-9a-f-]+)/.exec(address)[1];
  await waitFor('location.hash.startsWith("#set/")');
  await evaluate(`location.hash = 'key/${set}'`);
  await waitFor('!!document.querySelector("#paint")', 600000);
  await waitFor('document.querySelector("#told").textContent === ""');
  await click('#paint');
  await waitFor('!!document.querySelector(".paint-stage canvas")');
  return { nothing: await measure('nothing'), automatic: await measure('automatic') };
});
