// The look of the film's page, over the style sheet of the studio. Adopted by the document once: the policy of the page
// forbids inline styles.
const rules = `
.page-film{max-width:94rem}
.page-film>.film-facts{margin:0 0 1rem}
.film-layout{display:grid;grid-template-columns:minmax(0,1fr) minmax(17rem,21rem);gap:1.4rem;align-items:start}
.film-stage{min-width:0}
.film-screen{position:relative;overflow:hidden;background:#0d0e10;border-radius:var(--radius) var(--radius) 0 0;
width:min(100%,calc(62vh*var(--shape)));margin-inline:auto;min-height:6rem}
.film-wrap{background:#0d0e10;border-radius:var(--radius) var(--radius) 0 0;overflow:hidden}
.film-video,.film-frame,.film-early{position:absolute;inset:0;width:100%;height:100%;object-fit:contain;display:block}
.film-gray{position:absolute;inset:0 auto 0 0;backdrop-filter:grayscale(1);pointer-events:none}
.film-line{position:absolute;inset-block:0;width:2px;margin-left:-1px;background:#fff;box-shadow:0 0 0 1px #0008;pointer-events:none}
.film-divider{position:absolute;inset:0;width:100%;height:100%;margin:0;appearance:none;background:none;cursor:ew-resize}
.film-divider::-webkit-slider-runnable-track{height:100%}
.film-divider::-webkit-slider-thumb{appearance:none;width:2.4rem;height:2.4rem;border-radius:50%;background:#fffc;border:2px solid #1b1507;
position:relative;top:calc(50% - 1.2rem)}
.film-divider::-moz-range-thumb{width:2.2rem;height:2.2rem;border-radius:50%;background:#fffc;border:2px solid #1b1507}
.film-divider:focus-visible{outline-offset:-4px}
.film-sides{position:absolute;inset:auto .6rem .5rem;margin:0;display:flex;justify-content:space-between;pointer-events:none}
.film-sides span{background:#000b;color:#fff;border-radius:1rem;padding:.1rem .6rem;font-size:.8rem}
.film-bar{display:flex;flex-wrap:wrap;align-items:center;gap:.4rem;padding:.5rem;background:var(--card);border:1px solid var(--line);border-top:0}
.film-bar button,.film-bar select,.film-tools button{padding:.3rem .8rem}
.film-bar .main-button{min-width:5.4rem;justify-content:center}
.film-bar button[aria-pressed=true]{background:var(--wash);border-color:var(--accent)}
#film-wishes>p:empty{display:none}#film-wishes>:last-child{margin:0}#film-wishes{padding-bottom:.6rem}
.film-clock{white-space:nowrap;font-variant-numeric:tabular-nums;padding-inline:.4rem;min-width:9.5rem}
.film-gap{flex:1}
.film-timeline{border:1px solid var(--line);border-top:0;border-radius:0 0 var(--radius) var(--radius);background:var(--card);padding:.4rem .9rem .9rem}
.film-tools{display:flex;align-items:center;gap:.4rem}
.film-tools .film-moment{flex:1;min-width:0;min-height:44px;margin:0;accent-color:var(--accent)}
.film-tools button{min-width:44px;justify-content:center}
.film-scroll{overflow-x:auto;scrollbar-width:thin;padding-inline:1rem;margin-inline:-.5rem}
.film-lanes{position:relative;min-width:100%;padding-bottom:.2rem}
.film-ruler{position:relative;height:1.5rem;font-size:.75rem;color:var(--soft);font-variant-numeric:tabular-nums;cursor:pointer;touch-action:pan-y}
.film-ruler span{position:absolute;bottom:0;border-left:1px solid var(--strong-line);padding-left:.25rem;white-space:nowrap;line-height:1.2}
.film-strip{display:flex;height:3.4rem;background:var(--line);border-radius:6px;overflow:hidden;cursor:pointer;touch-action:pan-y}
.film-strip img{flex:1 1 0;min-width:0;height:100%;object-fit:cover;user-select:none;-webkit-user-drag:none}
.film-lane{position:relative;height:1.7rem;margin-top:.35rem}
.film-shots{cursor:pointer;touch-action:pan-y}
.film-shots span{position:absolute;inset-block:0;background:var(--paper);border:1px solid var(--line);border-radius:5px;font-size:.75rem;
color:var(--soft);padding:.1rem .4rem;overflow:hidden;white-space:nowrap;text-overflow:ellipsis;min-width:2px}
.film-keys{height:2.75rem;border-bottom:1px solid var(--line)}
.film-keys button{position:absolute;top:0;width:44px;min-height:44px;margin-left:-22px;padding:0;border:0;background:none;display:grid;place-items:center}
.film-keys button::before{content:"";width:15px;height:15px;transform:rotate(45deg);border:2px solid var(--accent);background:var(--card);border-radius:2px}
.film-key.used::before,.film-key[aria-pressed=true]::before{background:var(--accent)!important}
.film-key[aria-pressed=true]::before{box-shadow:0 0 0 3px var(--card),0 0 0 5px var(--accent)}
.film-keys .proposed::before{border:2px dotted var(--soft);border-radius:3px}
.film-parts{height:3rem}
.film-part{position:absolute;top:2px;height:44px;min-width:4px}
.film-part-body{position:absolute;inset:0;width:100%;min-width:0;padding:0 .5rem;overflow:hidden;background:var(--wash);border-color:var(--accent);
border-radius:0;font-size:.82rem;justify-content:flex-start;white-space:nowrap}
.film-part-name{overflow:hidden;text-overflow:ellipsis}
.film-part.picked .film-part-body{background:var(--accent);color:var(--on-accent)}
.film-edge{position:absolute;inset-block:0;width:18px;background:var(--accent);cursor:ew-resize;touch-action:none;z-index:1}
.film-edge::before{content:"";position:absolute;inset:-2px -13px}
.film-edge::after{content:"";position:absolute;inset:12px 8px;background:var(--on-accent)}
.film-edge.begin{right:100%;border-radius:7px 0 0 7px}.film-edge.end{left:100%;border-radius:0 7px 7px 0}
.film-edge.begin::before{right:-2px}.film-edge.end::before{left:-2px}
.film-head{position:absolute;inset-block:0;width:2px;margin-left:-1px;background:var(--ink);pointer-events:none;z-index:2}
.film-head::before{content:"";position:absolute;top:0;left:-5px;border:6px solid transparent;border-top-color:var(--ink);border-bottom:0}
.film-side>*{margin-bottom:1rem}
.page-film .share{margin-top:2rem}
.film-items{list-style:none;margin:0 0 .4rem;padding:0}
.film-items li{border:1px solid var(--line);border-radius:8px;margin-bottom:.4rem;overflow:hidden}
.film-items li.picked{border-color:var(--accent);box-shadow:0 0 0 1px var(--accent)}
.film-item-head{width:100%;border:0;border-radius:0;gap:.7rem;padding:.35rem;text-align:left;background:none}
.film-item-head img{width:4.6rem;aspect-ratio:16/10;object-fit:cover;border-radius:4px;background:var(--line);flex:none}
.film-item-head>span{min-width:0}
.film-item-time,.film-item-head .small{display:block;overflow-wrap:anywhere}
.film-item-time{font-weight:600;font-variant-numeric:tabular-nums}
.film-item-detail{padding:.3rem .7rem .7rem}
.film-item-detail p{margin:0 0 .6rem}
.film-items .proposal{border:1px dashed var(--strong-line);border-radius:8px}
.film-proposals li{border:0}
.film-options label{display:flex;gap:.5rem;align-items:flex-start;min-height:44px;padding-top:.6rem;cursor:pointer}
.film-options input[type=checkbox]{width:1.15rem;height:1.15rem;flex:none;margin-top:.2rem;accent-color:var(--accent)}
.film-options input[type=number]{width:5.5rem;font:inherit;color:inherit;background:var(--card);border:1px solid var(--strong-line);border-radius:8px;padding:.3rem .5rem;min-height:44px}
.film-painter{height:76vh}
.film-painting .film-layout{grid-template-columns:minmax(0,1fr)}
#film-start{width:100%;justify-content:center;font-size:1.06rem}
@media(max-width:60rem){.film-layout{grid-template-columns:minmax(0,1fr)}.film-screen{width:min(100%,calc(56vh*var(--shape)))}}
@media(max-width:34rem){.film-gap{display:none}.film-bar{gap:.3rem}.film-timeline{padding-inline:.4rem}.film-clock{min-width:0;flex:1;text-align:right;font-size:.93rem}
.film-bar select{flex:1}}
`;

export const adoptFilmStyle = (() => {
  let sheet: CSSStyleSheet | undefined;
  return (): void => {
    if (sheet) return;
    sheet = new CSSStyleSheet();
    sheet.replaceSync(rules);
    document.adoptedStyleSheets = [...document.adoptedStyleSheets, sheet];
  };
})();
