// Colours a film in the studio in headless Chromium, by mouse and keyboard as a person would, and tells what was seen,
// as JSON on stdout.
//   node use_film.mjs CHROMIUM ADDRESS FILM OUT [SCREENSHOTS]
// ADDRESS: as `color3d studio` printed it; FILM: a file to choose; OUT: what was saved. facts: what was measured. With a
// fifth argument every page leaves a PNG there, light, dark and narrow.
import { pause } from '../../tests/support/browser.mjs';
import { drawnBySoftware, openPage } from '../../tests/support/page_hand.mjs';

const [chromium, address, film, out, screenshots] = process.argv.slice(2);
const { send, evaluate, waitFor, boxOf, drag, click, clickText, press, type, choose, saveTo, savedAs, keep, look, tell } =
    openPage(chromium, address, screenshots, { flags: [...drawnBySoftware, '--window-size=1280,1000'], whole: true });
const facts = {};

const middleOf = async (selector) => {
  const { x, y, width, height } = await boxOf(selector);
  return [x + width / 2, y + height / 2];
};
const moment = () => evaluate('Number(document.getElementById("film-moment").value)');
const clock = () => evaluate('document.getElementById("film-clock").textContent');
// Mean colours (0..255) of the left and the right part of the film as it is on the screen.
const colors = async () => {
  await boxOf('.film-screen');
  await pause(500);
  const box = await boxOf('.film-screen');
  const { data } = await send('Page.captureScreenshot', { format: 'png', clip: { ...box, scale: 1 } });
  return evaluate(`(async () => {
    const picture = await createImageBitmap(new Blob([Uint8Array.from(atob('${data}'), (letter) => letter.charCodeAt(0))]));
    const canvas = new OffscreenCanvas(picture.width, picture.height), context = canvas.getContext('2d');
    context.drawImage(picture, 0, 0);
    const chroma = (from, to) => {
      const x = Math.round(from * picture.width), width = Math.round((to - from) * picture.width);
      const part = context.getImageData(x, Math.round(0.1 * picture.height), width, Math.round(0.25 * picture.height)).data;
      let sum = 0;
      for (let i = 0; i < part.length; i += 4) sum += Math.max(part[i], part[i + 1], part[i + 2]) - Math.min(part[i], part[i + 1], part[i + 2]);
      return sum / (part.length / 4);
    };
    return { left: chroma(0.05, 0.4), right: chroma(0.6, 0.95) };
  })()`);
};
const heap = async () => {
  await send('HeapProfiler.collectGarbage');
  const { metrics } = await send('Performance.getMetrics');
  return metrics.find((metric) => metric.name === 'JSHeapUsedSize').value;
};
const loops = async (count) => {
  await evaluate(`window.seenLoops = 0; window.before = -1; window.watch = setInterval(() => {
    const now = Number(document.getElementById('film-moment').value);
    if (now < window.before) ++window.seenLoops;
    window.before = now;
  }, 15)`);
  const end = Date.now() + 90000;
  while (await evaluate('window.seenLoops') < count && Date.now() < end) await pause(50);
  await evaluate('clearInterval(window.watch)');
  return evaluate('window.seenLoops');
};

const play = async () => {
  await evaluate('document.getElementById("film-moment").focus()');
  await press('Home');
  await press('.');
  await press('.');
  await press(',');
  facts.steps = await moment();
  await evaluate('document.activeElement.blur()');
  await press(' ');
  await waitFor('document.getElementById("film-play").textContent === "Pause"');
  facts.loops_before = await loops(2);
  const before = await heap();
  facts.loops = await loops(10);
  facts.heap = [before, await heap()];
  await press(' ');
  const stopped = await moment();
  await pause(400);
  facts.pause_holds = await moment() === stopped;
};

// The film, beside grey, and two of its frames, with the credit.
const share = async () => {
  await saveTo(out);
  await type('#credit-colored_by', 'Erika Müller');
  for (const [button, file] of [
    ['Save the film', 'scene.mp4'], ['Save it beside grey', 'side_by_side.mp4'], ['Save the report', 'report.html'],
    ['Save the coloured frame', 'key_view_colored.png'], ['Save the frame that is shown', 'scene_frame_000005.jpg'],
  ]) {
    await clickText(button);
    await savedAs(file);
  }
};

const use = async () => {
  await send('Performance.enable');
  await waitFor('!!document.querySelector(".drop-area")');
  await choose('#choose-files', film);
  await waitFor('location.hash.startsWith("#film/") && !!document.querySelector("#film-moment")');
  await waitFor('document.querySelector("main").dataset.state === "chosen"', 120000);
  await look('chosen');
  facts.movie_plays = await waitFor('document.querySelector(".film-video").readyState >= 2 || document.querySelector(".film-screen").dataset.movie === "no"')
      && await evaluate('!document.querySelector(".film-video").hidden');
  facts.gray = await colors();
  facts.shots = await evaluate('document.querySelectorAll(".film-shots span").length');

  // Scrub by mouse on the strip, and by keys.
  const strip = await boxOf('.film-strip');
  const onStrip = (share) => [strip.x + share * strip.width, strip.y + strip.height / 2];
  await drag(onStrip(0.75), onStrip(0.5), 1);
  facts.scrubbed = (await moment()) / await evaluate('Number(document.getElementById("film-moment").max)');

  // The proposed frame has automatic colours.
  facts.keys = await evaluate('document.querySelectorAll(".film-key:not(.proposed)").length');
  facts.proposals = await evaluate('[...document.querySelectorAll(".film-key.proposed")].map((mark) => mark.title)');
  await click('#film-start');
  await waitFor('location.hash.split("/").length === 3');
  await waitFor('document.querySelector(".film-early:not([hidden])") || document.querySelector("[data-pictures=early] img[src]") || document.querySelector("main").dataset.state === "done"', 120000);
  facts.early = await evaluate("document.querySelectorAll(\"[data-pictures=early] img\").length");
  await look('running');
  await waitFor('document.querySelector("main").dataset.state === "done"', 240000);
  await waitFor('document.querySelector(".film-video").readyState >= 2 || document.querySelector(".film-screen").dataset.movie === "no"');
  await look('done');
  facts.colored = await colors();
  await click('#film-compare');
  facts.compared = await colors();
  await keep('compared');
  await click('#film-compare');
  await play();
  await evaluate('document.getElementById("film-moment").focus()');
  await press('Home');
  for (let i = 0; i < 5; ++i) await press('ArrowRight');
  await share();

  // Other colours for a part: painted, its ends dragged by the mouse and moved by keys.
  await evaluate('document.getElementById("film-moment").focus()');
  await press('ArrowRight');
  await pause(400);
  await click('#add-part');
  await waitFor('!!document.querySelector("#parts-0-way")');
  await evaluate('document.getElementById("parts-0-way").focus()');
  await press('P');  // the option that begins with it: Paint
  await waitFor('!!document.querySelector("#film-painter canvas")', 20000);
  await pause(800);
  const [x, y] = await middleOf('#film-painter canvas');
  await drag([x - 60, y], [x + 60, y], 10);
  await waitFor('!document.querySelector(".paint-busy")');
  await look('painting');
  await click('#paint-done');
  const ends = () => evaluate('[...document.querySelectorAll(".film-edge")].map((edge) => Number(edge.getAttribute("aria-valuenow")))');
  facts.part_first = await ends();
  const edge = await middleOf('.film-edge.end');
  await drag(edge, [edge[0] - 150, edge[1]]);
  facts.part_dragged = await ends();
  await evaluate('document.querySelector(".film-edge.begin").focus()');
  await press('ArrowRight');
  facts.part_by_key = await ends();
  await evaluate('document.activeElement.blur()');
  await press('z', 2);
  facts.part_undone = await ends();
  await press('z', 10);
  await look('part');
  const before = await evaluate('location.hash');
  await click('#film-start');
  await waitFor(`location.hash !== ${JSON.stringify(before)}`);
  await waitFor('document.querySelector("main").dataset.state === "done"', 240000);
  await look('again');
  facts.part_kept = await ends();
  await click('#go-sheet');
  await waitFor('document.querySelector("#print")?.disabled === false', 120000);
  facts.sheet = await evaluate('[...document.querySelectorAll(".sheet img")].map((image) => image.naturalWidth)');
  await look('sheet');
  return { facts };
};

await tell(use);
