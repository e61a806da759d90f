// The studio's page: which part is shown follows the address (#set/ID, #key/ID, #job/ID, #sheet/ID).
import { stayAlive } from './alive';
import { h, problem, replace } from './dom';
import { showFilm } from './film/film';
import { showHome } from './home';
import { showKey } from './key';
import { showPhotos } from './photos';
import { showRun } from './run';
import { showSheet } from './share/sheet';

// Shows itself in `main`. Returns what to do when it is left.
export type Show = (main: HTMLElement, id: string) => (() => void) | void;

const pages: Record<string, { show: Show; step: number }> = {
  '': { show: showHome, step: 0 },
  set: { show: showPhotos, step: 1 },
  key: { show: showKey, step: 2 },
  job: { show: showRun, step: 3 },
  sheet: { show: showSheet, step: 3 },
  film: { show: showFilm, step: 0 },
};
const stepNames = ['Photos', 'Colours', 'Scene'];

let leave: (() => void) | void;
let setOfSteps = '';

const showSteps = (step: number, kind: string, id: string): void => {
  const nav = document.getElementById('steps')!;
  if (kind === 'set' || kind === 'key') setOfSteps = id;
  nav.hidden = step === 0;
  const link = (name: string, number: number): HTMLElement => {
    const target = number === 1 ? `#set/${setOfSteps}` : number === 2 ? `#key/${setOfSteps}` : '';
    const current = number === step ? { 'aria-current': 'step' } : {};
    const text = [h('span', { class: 'number' }, String(number)), h('span', { class: 'step' }, name)];
    return h('li', current, setOfSteps && target && number !== step && number < 3
      ? h('a', { href: target }, ...text) : h('span', {}, ...text));
  };
  replace(nav, h('ol', {}, ...stepNames.map((name, i) => link(name, i + 1))));
};

// Pages of jobs tell which photos they are of.
export const setStepsOf = (set: string, step: number): void => {
  setOfSteps = set;
  showSteps(step, '', '');
};

const show = (): void => {
  const main = document.getElementById('main-content')!;
  const [kind = '', id = ''] = location.hash.slice(1).split('/');
  if (location.hash === '#main-content') return;
  const page = pages[kind] ?? pages['']!;
  leave?.();
  main.className = `page-${kind || 'home'}`;
  replace(main);
  showSteps(page.step, kind, id);
  try {
    leave = page.show(main, id);
  } catch (error) {
    replace(main, problem(String(error)));
  }
  window.scrollTo(0, 0);
};

document.getElementById('skip')!.addEventListener('click', (event) => {
  event.preventDefault();
  document.getElementById('main-content')!.focus();
});
// A file that misses the drop area must not replace the page.
for (const kind of ['dragover', 'drop'] as const) addEventListener(kind, (event) => event.preventDefault());
stayAlive(document.getElementById('gone')!);
addEventListener('hashchange', show);
show();
