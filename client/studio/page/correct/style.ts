// The look of the corrections, by the custom properties of studio.css.
const rules = `
main:has(.co){max-width:112rem}
.co{display:grid;grid-template-columns:minmax(0,1fr) minmax(16rem,20rem);gap:1.2rem;align-items:start}
.co-bar{grid-column:1/-1;display:flex;flex-wrap:wrap;gap:.6rem 1.2rem;align-items:center}
.co-group{display:flex;flex-wrap:wrap}
.co-group button{border-radius:0;margin-left:-1px}
.co-group button:first-child{border-radius:8px 0 0 8px;margin:0}.co-group button:last-child{border-radius:0 8px 8px 0}
.co button[aria-pressed=true]{background:var(--accent);border-color:var(--accent);color:var(--on-accent)}
.co-group button[aria-pressed=true]+button[aria-pressed=true]{border-left-color:var(--on-accent)}
.co-panes{display:grid;grid-auto-flow:column;grid-auto-columns:minmax(0,1fr);gap:.6rem}
.co-picture{margin:0;min-width:0}
.co-canvases{position:relative;aspect-ratio:var(--aspect,3/2);background:#0d0e10}
.co-canvases canvas{position:absolute;inset:0;width:100%;height:100%}
.co-canvases canvas:last-child{touch-action:none;cursor:crosshair;outline-offset:-3px}
.co-picture figcaption{font-size:.87rem;color:var(--soft);padding:.25rem 0 0}
.co-scene{position:relative;min-height:20rem;background:#000;overflow:hidden}
.co-scene .scene{position:absolute;inset:0;width:100%;height:100%;border:0;border-radius:0}
.co-scene .co-coming{visibility:hidden}
.co-pane-scene{min-width:0;display:flex;flex-direction:column}.co-pane-scene .co-scene{flex:1}
.co-pane-scene>p{font-size:.87rem;color:var(--soft);margin:0;padding:.25rem 0 0}
.co-main{min-width:0}
.co-strip{display:flex;gap:.4rem;overflow-x:auto;list-style:none;margin:.8rem 0 0;padding:.25rem}
.co-strip li{flex:none}
.co-strip button{display:block;padding:.25rem;min-height:0;text-align:left;font-size:.8rem;border-color:transparent;position:relative}
.co-strip canvas{display:block;height:5.25rem;border-radius:4px;background:var(--line)}
.co-strip .name{max-width:8rem;margin:.15rem 0 0;color:inherit}
.co-note:not(:empty){position:absolute;right:.45rem;top:.45rem;background:#000;color:#fff;border-radius:4px;padding:0 .3rem}
.co-side{display:grid;gap:1rem}
.co-section{padding:1rem 1.1rem;border:1px solid var(--line);border-radius:var(--radius);background:var(--card)}
.co-section h3{font-size:1rem;margin:0 0 .5rem}
.co-section>*{margin-bottom:.7rem}.co-section>:last-child{margin-bottom:0}
.co-slider{display:grid;grid-template-columns:auto 1fr;gap:0 .8rem;align-items:baseline;font-size:.93rem}
.co-slider output{text-align:right;color:var(--soft);font-variant-numeric:tabular-nums}
.co-slider input{grid-column:1/-1;width:100%;accent-color:var(--accent);height:32px;margin:0}
.co-section input[type=color]{width:3.2rem;height:44px;padding:.2rem;border:1px solid var(--strong-line);border-radius:8px;background:var(--card)}
.co-here{width:44px;height:44px;border-radius:8px;border:1px solid var(--strong-line)}
.co-swatches{display:flex;flex-wrap:wrap;gap:.3rem}.co-swatches:empty{display:none}
.co-swatch{width:32px;min-height:32px;padding:0;border-radius:6px}
.co-draft{border-left:4px solid var(--accent);background:var(--wash);padding:.7rem .9rem;border-radius:0 8px 8px 0}
.co-draft .row{margin-top:.5rem}
.co-history{list-style:none;margin:0;padding:0;display:grid;gap:.7rem}
.co-history li{display:flex;gap:.7rem;align-items:start}
.co-pair{display:flex;gap:2px;flex:none;border-radius:6px;overflow:hidden}
.co-pair canvas{width:48px;height:48px;display:block;background:var(--line)}
.co-what{min-width:0;font-size:.93rem}.co-what .row{margin-top:.3rem;gap:.3rem}
.co-what button{min-height:34px;padding:.15rem .6rem;font-size:.87rem}
.co-legend{display:flex;flex-wrap:wrap;gap:.2rem 1rem;font-size:.87rem;color:var(--soft);margin:.5rem 0 0}
.co-legend i{display:inline-block;width:.9em;height:.9em;border-radius:3px;margin-right:.4em;vertical-align:-.1em;border:1px solid var(--strong-line)}
.co-status{min-height:1.5em;margin:.5rem 0 0;font-size:.93rem}
.co-status progress{margin-top:.3rem}
@media (max-width:60rem){.co{grid-template-columns:minmax(0,1fr)}}
@media (max-width:44rem){.co-panes{grid-auto-flow:row;grid-auto-columns:auto}}
`;
let sheet: CSSStyleSheet | undefined;
export const useStyle = (): void => {
  if (sheet) return;
  sheet = new CSSStyleSheet();
  sheet.replaceSync(rules);
  document.adoptedStyleSheets = [...document.adoptedStyleSheets, sheet];
};
