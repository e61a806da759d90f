// A contact sheet for print: A4 pages as they will come out of the printer.
import { artifactUrl, describeSet, follow, getState, type Found, type PhotoSet, type Run } from '../api';
import { button, h, problem, replace, say } from '../dom';
import { setStepsOf } from '../main';
import { coloredUrl, getCredit } from './calls';
import { adoptShareStyle } from './style';
import { creditText, frameText, pagesOf, spread, stem } from './texts';

const onFirstPage = 9, onOthers = 12, mostPhotos = 57;
const sideOfThumb = 640; // px

interface Picture { src: string; text: string }

const lastState = (id: string): Promise<Run> => new Promise((done, failed) => {
  const stop = follow(id, {
    run: (run) => { stop(); done(run); },
    problem: (text) => failed(new Error(text)),
    end: () => undefined,
  });
});

const picturesOf = async (run: Run, set: PhotoSet | undefined, found: Found | undefined): Promise<{ key: Picture[]; others: Picture[] }> => {
  const isFilm = found?.kind === 'film';
  const keyText = isFilm && run.key_view ? frameText(stem(run.key_view)) : 'Key photo';
  const key: Picture[] = run.artifacts.some(({ name }) => name === 'key_view_colored.png')
    ? [{ src: artifactUrl(run.id, 'key_view_colored.png'), text: `${keyText}, coloured` }] : [];
  const original = run.artifacts.find(({ name }) => name === 'key_view.png');
  if (original) key.unshift({ src: artifactUrl(run.id, original.name), text: `${keyText}, original${run.key_view && !isFilm ? `: ${stem(run.key_view)}` : ''}` });
  if (!set || !found || found.kind !== 'photos') {
    const drawn = run.artifacts.filter(({ name }) => /^renders\/.*\.png$/.test(name));
    return { key, others: spread(drawn, isFilm ? onFirstPage : mostPhotos).map(({ name }) =>
      ({ src: artifactUrl(run.id, name), text: isFilm ? frameText(stem(name)) : `${stem(name)}, drawn from the scene` })) };
  }
  const rest = found.photos.filter(({ name }) => !run.key_view || stem(name) !== stem(run.key_view));
  return { key, others: spread(rest, mostPhotos).map(({ name }) => ({ src: coloredUrl(run.id, set.id, name, sideOfThumb), text: stem(name) })) };
};

const figure = ({ src, text }: Picture, loads: Promise<void>[]): HTMLElement => {
  const image = h('img', { src, alt: text });
  loads.push(new Promise((done) => {
    image.addEventListener('load', () => done());
    image.addEventListener('error', () => done());
  }));
  return h('figure', {}, image, h('figcaption', {}, text));
};

export const showSheet = (main: HTMLElement, id: string): (() => void) => {
  adoptShareStyle();
  let left = false;
  const waiting = h('p', { class: 'soft', role: 'status' }, 'Colouring the photos for the sheet …');
  const print = button('Print, or save as PDF', () => window.print(), { class: 'main-button', id: 'print', disabled: true });
  const sheets = h('div', { class: 'sheets', id: 'sheets' });
  replace(main,
    h('div', { class: 'no-print' }, h('h1', {}, 'Contact sheet'),
      h('p', { class: 'row' }, print, h('a', { class: 'button', href: `#job/${id}` }, 'Back to the scene')), waiting),
    sheets);
  const load = async (): Promise<void> => {
    const [run, { sets }, credit] = await Promise.all([lastState(id), getState(), getCredit()]);
    const set = sets.find((one) => one.scene === run.scene);
    const found = set && (await describeSet(set.id)).found;
    if (set) setStepsOf(set.id, found?.kind === 'photos' ? 3 : 0); // films go without steps
    const { key, others } = await picturesOf(run, set, found);
    if (left) return;
    const loads: Promise<void>[] = [];
    const pages = pagesOf(others, onFirstPage, onOthers);
    const title = set?.name ?? 'Coloured scene';
    const day = new Date().toLocaleDateString(undefined, { dateStyle: 'long' });
    replace(sheets, ...pages.map((page, i) => h('article', { class: 'sheet', 'aria-label': `Page ${i + 1}` },
      h('header', { class: 'sheet-head' }, h('strong', {}, title), h('span', {}, `${day} · page ${i + 1} of ${pages.length}`)),
      i === 0 && h('div', { class: 'sheet-key' }, ...key.map((one) => figure(one, loads))),
      h('div', { class: i === 0 ? 'sheet-grid sheet-first' : 'sheet-grid' }, ...page.map((one) => figure(one, loads))),
      h('footer', { class: 'sheet-foot' }, creditText(credit)))));
    await Promise.all(loads);
    if (left) return;
    waiting.textContent = `${pages.length === 1 ? 'One page' : `${pages.length} pages`} of A4.`;
    print.disabled = false;
    main.dataset.state = 'done';
    say(waiting.textContent);
  };
  void load().catch((error: Error) => replace(waiting, problem(error.message)));
  return () => {
    left = true;
    delete main.dataset.state;
  };
};
