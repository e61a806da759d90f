// What the scripts that correct a scene (use_corrector.mjs, measure_correction.mjs, ../../../walk_scene.mjs) share.

// An expression: what the corrector says of itself by this name; '' before there is one.
export const data = (name) => `(document.querySelector('#corrector')?.dataset[${JSON.stringify(name)}] ?? '')`;
// The coloured photo, where strokes are drawn.
export const main = '.co-panes figure:nth-of-type(2) canvas:last-child';

// `hand`: of page_hand.mjs.
export const setColor = ({ evaluate }, hex) => evaluate(`(() => {
  const input = document.querySelector('#co-color');
  input.value = ${JSON.stringify(hex)};
  input.dispatchEvent(new Event('input'));
})()`);
// Draws between two places, shares of the coloured photo.
export const draw = async ({ boxOf, drag }, from, to) => {
  const { x, y, width, height } = await boxOf(main);
  const at = ([u, v]) => [x + u * width, y + v * height];
  await drag(at(from), at(to));
};
// Moves a slider by the mouse, between shares of it. Returns ms between frames meanwhile, and their number.
export const slide = async ({ evaluate, boxOf, mouse, keep }, selector, from, to) => {
  const { x, y, width, height } = await boxOf(selector);
  await evaluate(`(() => {
    window.color3dFrames = [];
    const tick = (now) => { window.color3dFrames.push(now); window.color3dTick = requestAnimationFrame(tick); };
    requestAnimationFrame(tick);
  })()`);
  await mouse('mousePressed', x + from * width, y + height / 2);
  for (let i = 1; i <= 30; ++i) await mouse('mouseMoved', x + (from + ((to - from) * i) / 30) * width, y + height / 2);
  const frames = await evaluate('cancelAnimationFrame(window.color3dTick), window.color3dFrames.slice(1).map((t, i) => t - window.color3dFrames[i])');
  await keep('saturation');
  await mouse('mouseReleased', x + to * width, y + height / 2);
  frames.sort((a, b) => a - b);
  return { median: frames[frames.length >> 1], worst: frames.at(-1), count: frames.length };
};
