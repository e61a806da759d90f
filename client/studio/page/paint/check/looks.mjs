// Runs in the page: what a reader would stumble over, as texts. Cut or overflowing labels, texts below the contrast of
// WCAG AA, controls that are too small for fingers.
export const looks = `() => {
  const problems = [];
  const parse = (text) => { const v = text.match(/[\\d.]+/g).map(Number); return [...v.slice(0, 3), v[3] ?? 1]; };
  const luminance = (rgb) => rgb.slice(0, 3).map((v) => { v /= 255;
    return v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4; })
    .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
  const behind = (e) => {
    for (; e; e = e.parentElement) {
      const color = parse(getComputedStyle(e).backgroundColor);
      if (color[3] > 0.6) return color;
    }
    return [255, 255, 255, 1];
  };
  const root = document.querySelector('.paint');
  if (document.documentElement.scrollWidth > innerWidth) problems.push('the page is wider than the window');
  for (const e of root.querySelectorAll('*')) {
    if (!e.checkVisibility() || e.closest('svg')) continue;
    const box = e.getBoundingClientRect(), style = getComputedStyle(e);
    const text = [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim());
    const name = '"' + (e.textContent.trim() || e.className || e.tagName).slice(0, 40) + '"';
    if (e.scrollWidth > e.clientWidth + 1 && e.clientWidth > 0 && style.display !== 'inline' && e.tagName !== 'INPUT') {
      problems.push(name + ' is ' + e.scrollWidth + ' px wide in ' + e.clientWidth);
    }
    if (text && (box.left < -1 || box.right > innerWidth + 1)) problems.push(name + ' leaves the window');
    if (e.matches('button') && (box.width < 24 || box.height < 24)) problems.push(name + ' is too small');
    if (!text || e.closest('[aria-disabled=true]') || style.opacity < 1) continue;
    const [x, y] = [luminance(parse(style.color)), luminance(behind(e))].sort((p, q) => q - p);
    if ((x + 0.05) / (y + 0.05) < 4.5) problems.push(name + ' has a contrast of ' + ((x + 0.05) / (y + 0.05)).toFixed(2));
  }
  return problems;
}`;
