// The look of sharing and of the sheet for print. Colours are those of the page (studio.css).
const rules = `
.share-form{border:1px solid var(--line);border-radius:var(--radius);background:var(--card);margin:0 0 1rem;padding:1rem 1.2rem;min-width:0}
.share-form legend{font-weight:600;padding:0 .4rem;margin-left:-.4rem}
.share-fields{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,13rem),1fr));gap:.2rem 1rem}
.share-fields p{margin:0 0 .5rem}
.share-fields label{display:block;font-size:.87rem;color:var(--soft)}
.share-fields input{font:inherit;width:100%;min-height:44px;padding:.4rem .7rem;color:var(--ink);background:var(--paper);
border:1px solid var(--strong-line);border-radius:8px}
.share-fields input::placeholder{color:var(--soft);opacity:1}
.share-credit{font-style:italic;margin:.2rem 0 .4rem;overflow-wrap:anywhere}
.share-check{display:flex;align-items:center;gap:.5rem;min-height:44px;cursor:pointer}
.share-check input{width:1.15rem;height:1.15rem;accent-color:var(--accent);flex:none}
.share-groups{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,21rem),1fr));gap:1rem}
.share-group{border:1px solid var(--line);border-radius:var(--radius);background:var(--card);padding:1rem 1.2rem;min-width:0}
.share-group h3{font-size:1rem;margin:0 0 .2rem}
.share-group .row{margin:.4rem 0 0}.share-format{flex:1;min-width:8rem}
.share-group :last-child{margin-bottom:0}
.share-place progress{margin-top:.4rem}
.queue-list{list-style:none;margin:0;padding:0}
.queue-item{display:flex;flex-wrap:wrap;align-items:center;gap:.3rem .8rem;padding:.4rem 0;border-bottom:1px solid var(--line)}
.queue-item:last-child{border:0}
.queue-name{flex:1 1 10rem;min-width:0;overflow-wrap:anywhere}
.queue-item button{min-height:44px;padding:.3rem .7rem}
.sheets{display:grid;grid-template-columns:minmax(0,210mm);justify-content:center;gap:1.5rem}
.sheet{container-type:inline-size;width:100%;aspect-ratio:210/297;background:#fff;color:#1a1a1a;display:grid;
grid-template-columns:minmax(0,1fr);grid-template-rows:auto auto minmax(0,1fr) auto;box-shadow:0 1px 8px #0003;overflow:hidden}
.sheet>*{margin-inline:6.2cqw}
.sheet-head{display:flex;flex-wrap:nowrap;justify-content:space-between;align-items:baseline;gap:3cqw;margin-top:6.2cqw;padding:0 0 1.4cqw;
border-bottom:.2cqw solid #1a1a1a;background:none;font-size:1.9cqw}
.sheet-head strong{font-size:2.7cqw;line-height:1.2;overflow-wrap:anywhere}
.sheet-head span{white-space:nowrap}
.sheet-key{grid-row:2;display:grid;grid-template-columns:1fr 1fr;gap:2.4cqw;padding-top:2.4cqw}
.sheet-grid{grid-row:3;display:grid;grid-template-columns:repeat(3,minmax(0,1fr));grid-template-rows:repeat(4,minmax(0,1fr));gap:2.4cqw;padding:2.4cqw 0}
.sheet-first{grid-template-rows:repeat(3,minmax(0,1fr))}
.sheet figure{margin:0;display:grid;grid-template-rows:minmax(0,1fr) auto;gap:.7cqw;min-width:0;min-height:0}
.sheet img{width:100%;height:100%;object-fit:contain;object-position:left bottom;display:block;min-height:0}
.sheet-key img{aspect-ratio:3/2;height:auto;object-position:left top}
.sheet figcaption{font-size:1.55cqw;line-height:1.3;color:#444;overflow:hidden;text-overflow:ellipsis;white-space:nowrap}
.sheet-foot{grid-row:4;margin-bottom:5cqw;padding-top:1.2cqw;border-top:.1cqw solid #888;font-size:1.7cqw;line-height:1.35}
@page{size:A4;margin:0}
@media print{
html,body{background:#fff!important}
body>header,.no-print,.said,.skip{display:none!important}
main{max-width:none!important;padding:0!important;margin:0!important}
.sheets{display:block}
.sheet{width:210mm;height:297mm;aspect-ratio:auto;box-shadow:none;break-after:page;break-inside:avoid;
print-color-adjust:exact;-webkit-print-color-adjust:exact}
.sheet:last-child{break-after:auto}
}`;

let sheet: CSSStyleSheet | undefined;

export const adoptShareStyle = (): void => {
  if (sheet) return;
  sheet = new CSSStyleSheet();
  sheet.replaceSync(rules);
  document.adoptedStyleSheets.push(sheet);
};
