// The look of the painter. Colours come from the page's custom properties (--paper, --card, --ink, --soft, --line,
// --accent, --on-accent); a page without them gets these. Laid out by the width of the host, from 320 px on.
const rules = `
.paint{container-type:inline-size;height:100%;min-height:26rem;color-scheme:light dark;
--p-page:var(--paper,#fbfaf8);--p-card:var(--card,#fff);--p-text:var(--ink,#1d1f21);--p-soft:var(--soft,#5b6166);
--p-line:var(--line,#dcdad5);--p-accent:var(--accent,#1f5fa8);--p-on:var(--on-accent,#fff);--p-desk:#d6d4d0;--p-press:#e9e7e2;
font:14px/1.4 system-ui,sans-serif;color:var(--p-text);text-align:start}
@media(prefers-color-scheme:dark){.paint{--p-page:var(--paper,#15171a);--p-card:var(--card,#1e2125);
--p-text:var(--ink,#e9e7e3);--p-soft:var(--soft,#a3a9af);--p-line:var(--line,#34383d);--p-accent:var(--accent,#7db4f0);
--p-on:var(--on-accent,#10151b);--p-desk:#0d0e10;--p-press:#2b3035}}
.paint *{box-sizing:border-box}
.paint [hidden]{display:none!important}
.paint :focus-visible{outline:3px solid var(--p-accent);outline-offset:1px}
.paint-grid{display:grid;height:100%;background:var(--p-card);grid-template:
"bar bar bar" auto "tools stage side" minmax(0,1fr) / 5.25rem minmax(0,1fr) 19rem}
.paint-bar{grid-area:bar;display:flex;gap:.25rem;padding:.3rem .5rem;border-bottom:1px solid var(--p-line);
overflow-x:auto;scrollbar-width:none}
.paint-group{display:flex;align-items:center;gap:.1rem;padding-inline-end:.45rem;border-inline-end:1px solid var(--p-line)}
.paint-group:last-child{border:0;margin-inline-start:auto;padding:0}
.paint button{font:inherit;color:inherit;background:none;border:1px solid transparent;border-radius:8px;cursor:pointer;
min-height:2.25rem;min-width:2.25rem;padding:.25rem .45rem;display:inline-flex;align-items:center;justify-content:center;
gap:.4rem;touch-action:manipulation}
.paint button:hover{background:var(--p-press)}
.paint button[aria-disabled=true]{color:var(--p-soft);opacity:.5;cursor:default;background:none}
.paint button[aria-pressed=true]{background:var(--p-accent);color:var(--p-on)}
.paint svg{width:1.35rem;height:1.35rem;flex:none;fill:none;stroke:currentColor;stroke-width:1.6;stroke-linecap:round;
stroke-linejoin:round}
.paint-zoom{min-width:3.6rem!important;font-variant-numeric:tabular-nums}
.paint-tools{grid-area:tools;display:flex;flex-direction:column;gap:.2rem;padding:.4rem;overflow-y:auto;
border-inline-end:1px solid var(--p-line)}
.paint-tools button{flex-direction:column;gap:.15rem;padding:.45rem .2rem;font-size:.75rem;line-height:1.15;width:100%}
.paint-tools span{max-width:100%;hyphens:auto;overflow-wrap:anywhere;text-align:center}
.paint-tools .paint-opener{display:none;position:relative}
.paint-stage{grid-area:stage;position:relative;overflow:hidden;background:var(--p-desk);min-width:0;min-height:0}
.paint-stage canvas{position:absolute;inset:0;width:100%;height:100%;display:block}
.paint-stage canvas:first-child{touch-action:none;outline-width:2px!important;outline-offset:-2px!important;cursor:none;-webkit-user-select:none;user-select:none}
.paint-stage[data-tool=picker] canvas:first-child{cursor:crosshair}
.paint-stage[data-grab] canvas:first-child{cursor:grab}
.paint-over{pointer-events:none}
.paint-notes{position:absolute;inset:auto .5rem .5rem;display:flex;flex-wrap:wrap;gap:.35rem;align-items:end;
pointer-events:none}
.paint-notes>*{background:#000b;color:#fff;border-radius:999px;padding:.15rem .65rem;font-size:.8rem;max-width:100%;
overflow-wrap:anywhere;border-radius:1rem}
.paint-notes>:empty{display:none}
.paint-busy::before{content:"";display:inline-block;width:.65em;height:.65em;margin-inline-end:.45em;border-radius:50%;
border:2px solid #fff;border-inline-end-color:#fff4;animation:paint-turn .8s linear infinite}
@keyframes paint-turn{to{transform:rotate(1turn)}}
@media(prefers-reduced-motion:reduce){.paint-busy::before{animation:none}}
.paint-side{grid-area:side;overflow-y:auto;border-inline-start:1px solid var(--p-line);padding:0 .9rem 1rem;
scrollbar-width:thin}
.paint-section{border-bottom:1px solid var(--p-line);padding:.15rem 0 .7rem}
.paint-section:last-child{border:0}
.paint-section summary{font-weight:600;cursor:pointer;padding:.45rem 0;list-style:none;display:flex;
justify-content:space-between;align-items:center}
.paint-section summary::-webkit-details-marker{display:none}
.paint-section summary::after{content:"";width:.5rem;height:.5rem;border:solid var(--p-soft);border-width:0 2px 2px 0;
transform:rotate(45deg);margin:0 .3rem .2rem}
.paint-section:not([open])>summary::after{transform:rotate(-45deg)}
.paint-section:not([open]){padding-bottom:0}
.paint h2{font-size:1.1rem;margin:0}
.paint h3{font-size:.8rem;font-weight:400;color:var(--p-soft);margin:.5rem 0 .3rem;overflow-wrap:anywhere}
.paint-hint{margin:.3rem 0 0;color:var(--p-soft);font-size:.85rem}
.paint-slider{display:grid;grid-template-columns:minmax(0,1fr) auto;gap:0 .5rem;margin:.15rem 0}
.paint-slider span,.paint-code span,.paint-select span,.paint-list span{color:var(--p-soft);font-size:.8rem;overflow-wrap:anywhere}
.paint-slider output{font-size:.8rem;font-variant-numeric:tabular-nums}
.paint-slider output{grid-area:1/2}
.paint-slider input{grid-area:2/1/auto/-1;width:100%;margin:0;height:1.6rem;accent-color:var(--p-accent);min-width:0}
.paint-hue input,.paint-chroma input{appearance:none;background:none}
.paint-hue input::-webkit-slider-runnable-track{height:.7rem;border-radius:1rem;background:linear-gradient(90deg,
#d9679a,#df6a6a,#d07a45,#b58b2f,#8d9a35,#5aa556,#2fa886,#2ba5b4,#4d9fd6,#7b94e2,#a587d9,#c777bb,#d9679a)}
.paint-hue input::-moz-range-track{height:.7rem;border-radius:1rem;background:linear-gradient(90deg,
#d9679a,#df6a6a,#d07a45,#b58b2f,#8d9a35,#5aa556,#2fa886,#2ba5b4,#4d9fd6,#7b94e2,#a587d9,#c777bb,#d9679a)}
.paint-chroma input::-webkit-slider-runnable-track{height:.7rem;border-radius:1rem;
background:linear-gradient(90deg,#8b8b8b,var(--full))}
.paint-chroma input::-moz-range-track{height:.7rem;border-radius:1rem;background:linear-gradient(90deg,#8b8b8b,var(--full))}
.paint-hue input::-webkit-slider-thumb,.paint-chroma input::-webkit-slider-thumb{appearance:none;width:1.15rem;height:1.15rem;
margin-top:-.22rem;border-radius:50%;background:#fff;border:2px solid #23272b;box-shadow:0 0 0 1px #fff}
.paint-check{display:flex;gap:.5rem;align-items:center;min-height:2rem;min-width:0;overflow-wrap:anywhere}
.paint-check input{width:1.1rem;height:1.1rem;flex:none;margin:0;accent-color:var(--p-accent)}
.paint-layer{display:grid;grid-template-columns:minmax(0,1fr) minmax(0,1fr);gap:.5rem;align-items:center}
.paint-layer .paint-slider{grid-template-columns:minmax(0,1fr) 2.7rem;align-items:center}
.paint-layer .paint-slider input{grid-area:1/1}
.paint-layer .paint-slider output{text-align:end}
.paint-select{display:grid;gap:.2rem;margin:.2rem 0}
.paint select,.paint-code input,.paint textarea{font:inherit;color:inherit;background:var(--p-page);
border:1px solid var(--p-soft);border-radius:8px;padding:.3rem .5rem;min-height:2.25rem;width:100%;min-width:0}
.paint-mix{display:flex;gap:.8rem;align-items:flex-start}
.paint-wheel{position:relative;width:7rem;height:7rem;flex:none;border-radius:50%;cursor:crosshair;touch-action:none;
background:repeating-conic-gradient(var(--p-press) 0 25%,transparent 0 50%) 0 0/10px 10px;box-shadow:0 0 0 1px var(--p-line)}
.paint-wheel canvas{width:100%;height:100%;display:block}
.paint-wheel i{position:absolute;width:14px;height:14px;margin:-7px;border-radius:50%;border:2px solid #fff;
box-shadow:0 0 0 1.5px #23272b,inset 0 0 0 1px #23272b;pointer-events:none}
.paint-mixers{flex:1;min-width:0;display:grid;gap:.1rem}
.paint-current{display:flex;gap:.5rem;align-items:end}
.paint-pair{display:flex;width:2.6rem;height:2.25rem;border-radius:8px;overflow:hidden;flex:none;
box-shadow:inset 0 0 0 1px var(--p-soft)}
.paint-pair span{flex:1}
.paint-code{display:grid;flex:1;min-width:0}
.paint-code input{padding:.2rem .4rem;font-variant-numeric:tabular-nums}
.paint-row{display:flex;flex-wrap:wrap;gap:.4rem;margin-top:.5rem}
.paint-row>*{flex:1 1 7rem;display:flex}
.paint-row button,.paint-list button{border-color:var(--p-line);overflow-wrap:anywhere;hyphens:auto}
.paint-file button{flex:1}
.paint-swatches{display:grid;grid-template-columns:repeat(auto-fill,minmax(2.2rem,1fr));gap:.3rem}
.paint button.paint-swatch{min-width:0;min-height:1.9rem;height:1.9rem;padding:0;border:1px solid #0003;border-radius:7px}
.paint button.paint-swatch[aria-pressed=true]{box-shadow:0 0 0 2px var(--p-card),0 0 0 4px var(--p-accent)}
.paint-list{display:grid;gap:.4rem;margin-top:.5rem}
.paint-dialog{color:var(--p-text);background:var(--p-card);border:1px solid var(--p-line);border-radius:12px;
width:min(36rem,calc(100vw - 1.5rem));max-height:min(42rem,calc(100vh - 1.5rem));padding:1rem 1.25rem;overflow:auto}
.paint-dialog::backdrop{background:#0008}
.paint-dialog header{padding:0;border:0;background:none;display:flex;justify-content:space-between;align-items:center}
.paint-dialog dl{margin:.5rem 0 0}
.paint-dialog dl div{display:flex;flex-wrap:wrap;justify-content:space-between;gap:.1rem 1.5rem;padding:.35rem 0;
border-bottom:1px solid var(--p-line)}
.paint-dialog dd{margin:0;color:var(--p-soft)}
@container(max-width:760px){
.paint-grid{grid-template:"bar" auto "stage" minmax(9rem,1fr) "tools" auto "side" auto / minmax(0,1fr)}
.paint-bar{padding:.2rem .25rem;gap:0}
.paint-group{padding-inline-end:.1rem;border:0}
.paint button.paint-zoom{display:none}
.paint-tools{flex-direction:row;border:0;border-top:1px solid var(--p-line);padding:.25rem;gap:.1rem;overflow:visible}
.paint-tools button{flex:1 1 0;min-width:0;min-height:2.75rem;padding:.3rem .1rem;font-size:.7rem}
.paint-tools .paint-opener{display:inline-flex;flex:0 0 3rem}
.paint-opener::after{content:"";position:absolute;inset-block-end:.25rem;width:1.5rem;height:.35rem;border-radius:1rem;
background:var(--now);box-shadow:0 0 0 1px #0004}
.paint-opener svg{margin-bottom:.55rem}
.paint-side{border:0;border-top:1px solid var(--p-line);max-height:16rem;padding:0 .75rem .5rem}
.paint-grid[data-side=closed] .paint-side{display:none}
.paint-swatches{grid-template-columns:repeat(auto-fill,minmax(2.4rem,1fr))}
.paint button.paint-swatch{height:2.4rem}
}
@container(max-width:460px){.paint-bar{padding:.15rem 0}.paint-group{gap:0;padding:0}.paint-group button{padding:.25rem 0}
.paint-group button.paint-wide{display:none}}
@media(pointer:coarse){.paint button{min-height:2.6rem}.paint-slider input{height:2.2rem}}
`;

// Adopted by the document once. A policy of the page that forbids inline styles allows this.
export const adoptStyle = (() => {
  let sheet: CSSStyleSheet | undefined;
  return (): void => {
    if (sheet) return;
    sheet = new CSSStyleSheet();
    sheet.replaceSync(rules);
    document.adoptedStyleSheets = [...document.adoptedStyleSheets, sheet];
  };
})();
