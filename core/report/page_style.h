// Style and script of the report page. For report_page.cc only.
#pragma once

namespace color3d {

// At most two columns of pictures on a phone of 320 px. Nothing is wider than the window: tables
// and long words scroll or break within their box.
inline constexpr char kReportStyle[] = R"css(
:root{color-scheme:light dark;--page:#fbfaf8;--card:#fff;--text:#1d1f21;--soft:#5b6166;--line:#dcdad5;
--accent:#1f5fa8;--seen:#6fb7b0;--inferred:#e0b25f;--guessed:#b873a0}
@media(prefers-color-scheme:dark){:root{--page:#15171a;--card:#1e2125;--text:#e9e7e3;--soft:#a3a9af;
--line:#34383d;--accent:#7db4f0}}
*{box-sizing:border-box}
body{font:16px/1.55 system-ui,sans-serif;margin:0;background:var(--page);color:var(--text);
overflow-wrap:anywhere}
header,main,footer{max-width:1120px;margin:0 auto;padding:0 1rem}
header{padding-top:1.25rem}footer{padding-bottom:2rem;color:var(--soft);font-size:.875rem}
h1{font-size:1.5rem;line-height:1.25;margin:0 0 .25rem}
h2{font-size:1.2rem;margin:2.25rem 0 .5rem}h3{font-size:1rem;margin:1.25rem 0 .4rem}
p{margin:.4rem 0;max-width:75ch}a{color:var(--accent)}
:focus-visible{outline:3px solid var(--accent);outline-offset:2px}
img{display:block;width:100%;height:auto;border-radius:6px;background:var(--line)}
figure{margin:0;min-width:0}figcaption{font-size:.875rem;color:var(--soft);margin-top:.2rem}
.rows{display:flex;flex-wrap:wrap;gap:0 1.5rem}
.rows>div{flex:1 1 15rem;max-width:34rem}
.row{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,15rem),1fr));gap:.75rem}
.compare{position:relative;overflow:hidden;border-radius:8px;touch-action:pan-y;
width:min(100%,960px,calc(75vh*var(--shape)))}
.compare img{border-radius:0}
.compare .over{position:absolute;inset:0;height:100%;clip-path:inset(0 calc(100% - var(--at)) 0 0)}
.compare .bar{position:absolute;top:0;bottom:0;left:var(--at);width:2px;margin-left:-1px;background:#fff;
box-shadow:0 0 3px #000}
.compare span{position:absolute;bottom:.5rem;padding:.05rem .5rem;border-radius:1rem;background:#000a;
color:#fff;font-size:.8rem;max-width:46%}
.compare .l{left:.5rem}.compare .r{right:.5rem}
.controls{display:flex;flex-wrap:wrap;gap:.5rem 1rem;align-items:end;margin:.6rem 0;max-width:960px}
.controls label{display:grid;font-size:.875rem;color:var(--soft);flex:1 1 12rem;min-width:0}
select,input[type=range]{width:100%;font:inherit;min-height:2.5rem}
.go{display:inline-block;padding:.6rem 1.1rem;border-radius:8px;background:#1f5fa8;color:#fff;
text-decoration:none}
.figures{display:grid;grid-template-columns:repeat(auto-fill,minmax(9rem,1fr));gap:.5rem;margin:1rem 0}
.figures div{background:var(--card);border:1px solid var(--line);border-radius:8px;padding:.5rem .75rem}
.figures dt{font-size:.8rem;color:var(--soft)}.figures dd{margin:0;font-size:1.25rem}
.box{overflow-x:auto;margin:.5rem 0}
table{border-collapse:collapse;font-size:.925rem}
td,th{padding:.25rem .9rem .25rem 0;text-align:left;vertical-align:top;border-bottom:1px solid var(--line);
overflow-wrap:normal}
td.v,th.v{text-align:right;font-variant-numeric:tabular-nums}.no{color:var(--soft)}
meter{width:8rem;max-width:30vw}
.warn{border-left:4px solid #d9821a;padding:.1rem .8rem}
.plots{display:flex;flex-wrap:wrap;gap:.5rem}.plot{width:360px;max-width:100%;height:auto}
.plot .t{font-size:12px;fill:currentColor}.plot .n{font-size:10px;fill:currentColor;opacity:.75}
.plot .g{stroke:currentColor;opacity:.15}.plot .c{fill:none;stroke:var(--accent);stroke-width:1.6}
.legend{list-style:none;padding:0;margin:.6rem 0;display:grid;gap:.35rem}
.legend li{display:flex;gap:.6rem;align-items:center}
.legend i{flex:none;width:2.5rem;height:1.4rem;border-radius:4px;border:1px solid var(--line)}
.legend .seen{background:#6fb7b0}
.legend .inferred{background:#e0b25f}
.legend .guessed{background:repeating-linear-gradient(135deg,#b873a0 0 4px,#6e4560 4px 8px)}
details{margin:.75rem 0}summary{cursor:pointer;padding:.4rem 0;font-weight:600}
pre{background:var(--card);border:1px solid var(--line);border-radius:8px;padding:.6rem .75rem;
white-space:pre-wrap;font-size:.875rem}
[hidden]{display:none!important}
)css";

// The slider uses the pictures in the chapter of the views, so that each is in the file once.
inline constexpr char kReportScript[] = R"js(
(() => {
const by = (id) => document.getElementById(id), box = by('compare');
if (!box) return;
const view = by('view'), pair = by('pair'), at = by('at'), images = box.querySelectorAll('img');
const labels = box.querySelectorAll('span');
const show = () => {
  const card = by('view-' + view.value), result = card.querySelector('[data-role=render]');
  const before = card.querySelector('[data-role=' + pair.value + ']');
  [before, result].forEach((picture, i) => {
    const image = images[1 - i];
    image.src = picture.src;
    image.alt = picture.alt;
    labels[i].textContent = picture.dataset.short;
  });
  box.style.setProperty('--shape', result.getAttribute('width') + '/' + result.getAttribute('height'));
};
const choose = () => {
  const card = by('view-' + view.value), wanted = pair.value;
  pair.replaceChildren(...[...card.querySelectorAll('[data-role]:not([data-role=render])')].map(
      (picture) => new Option(picture.dataset.short, picture.dataset.role)));
  if (card.querySelector('[data-role=' + wanted + ']')) pair.value = wanted;
  show();
};
const move = () => {
  box.style.setProperty('--at', at.value + '%');
  at.setAttribute('aria-valuetext', at.value + ' % of the picture before');
};
const drag = (event) => {
  const area = box.getBoundingClientRect();
  at.value = Math.round(100 * (event.clientX - area.left) / area.width);
  move();
};
box.addEventListener('pointerdown', (event) => {
  event.preventDefault();
  box.setPointerCapture(event.pointerId);
  drag(event);
});
box.addEventListener('pointermove', (event) => { if (event.buttons) drag(event); });
at.addEventListener('input', move);
view.addEventListener('change', choose);
pair.addEventListener('change', show);
by('controls').hidden = false;
choose();
move();
})();
)js";

}  // namespace color3d
