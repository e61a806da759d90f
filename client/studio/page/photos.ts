// What was found in the photos and what will be done.
import { describeSet, photoUrl, planRun, type Found, type FoundPhoto, type Plan } from './api';
import { button, h, problem, replace, say } from './dom';
import { setAsFrames } from './film/film_api';
import { bytes, kindName, seconds, stageName } from './words';

const shownAtFirst = 24;

const fact = (name: string, value: string): HTMLElement => h('div', {}, h('dt', {}, name), h('dd', {}, value));

const sizes = (photos: FoundPhoto[]): string => {
  const known = photos.filter((photo) => photo.width);
  if (!known.length) return 'unknown';
  const texts = new Set(known.map(({ width, height }) => `${width} × ${height}`));
  return texts.size === 1 ? `${[...texts][0]} px` : `${texts.size} sizes, up to ${Math.max(...known.map(({ width }) => width!))} px wide`;
};

const facts = (found: Found): HTMLElement => {
  const color = found.in_color === null ? 'cannot tell' : found.in_color
    ? 'in colour: their own colours are not used' : 'monochrome';
  const rows = found.kind === 'photos'
    ? [fact('Found', `${found.photos.length} photos, ${bytes(found.bytes)}`), fact('Size', sizes(found.photos)),
      fact('Colour', color), fact('Camera positions', found.has_poses ? 'in the folder' : 'will be found')]
    : [fact('Found', `${kindName(found.kind)}, ${bytes(found.bytes)}`)];
  return h('dl', { class: 'facts' }, ...rows);
};

// Pictures of one size with numbers in their names.
const mayBeFrames = (found: Found): boolean => found.kind === 'photos' && found.photos.length > 2
  && found.photos.every(({ name, width, height }) => /\d[^/]*$/.test(name) && width === found.photos[0]!.width && height === found.photos[0]!.height);

const grid = (set: string, photos: FoundPhoto[]): HTMLElement => {
  const list = h('ul', { class: 'thumbs' });
  const add = (some: FoundPhoto[]): void => list.append(...some.map((photo) => h('li', photo.problem ? { class: 'odd' } : {},
    photo.problem ? h('p', { class: 'small' }, photo.problem)
      : h('img', { src: photoUrl(set, photo.name, 240), alt: photo.name, loading: 'lazy' }),
    h('span', { class: 'name' }, photo.name))));
  add(photos.slice(0, shownAtFirst));
  if (photos.length <= shownAtFirst) return list;
  const more = button(`Show all ${photos.length}`, () => {
    add(photos.slice(shownAtFirst));
    more.remove();
  }, { class: 'quiet' });
  return h('div', {}, list, more);
};

const planTable = (plan: Plan): HTMLElement => h('details', { class: 'plan' },
  h('summary', {}, `About ${seconds(plan.seconds)} and ${bytes(plan.bytes)} of memory`),
  h('table', {},
    h('thead', {}, h('tr', {}, h('th', { scope: 'col' }, 'Step'), h('th', { scope: 'col' }, 'Time'), h('th', { scope: 'col' }, 'Memory'))),
    h('tbody', {}, ...plan.stages.filter((stage) => stage.runs).map((stage) => h('tr', { title: stage.reason },
      h('th', { scope: 'row' }, stageName(stage.kind)), h('td', {}, seconds(stage.seconds)),
      h('td', {}, stage.bytes ? bytes(stage.bytes) : '–'))))),
  plan.measured_jobs === 0 && h('p', { class: 'soft small' }, 'Estimated for a machine with two cores; this one has not been measured yet.'));

export const showPhotos = (main: HTMLElement, set: string): (() => void) => {
  let left = false, isLooking = true;
  const body = h('div', { class: 'stack' }, h('p', { class: 'soft' }, 'Looking at the photos …'));
  const title = h('h1', {}, 'Photos');
  replace(main, title, body);
  const asFilm = async (): Promise<void> => {
    try {
      await setAsFrames(set, true);
      location.hash = `film/${set}`;
    } catch (error) {
      body.append(problem((error as Error).message));
    }
  };
  const load = async (): Promise<void> => {
    try {
      const { name, found } = await describeSet(set);
      if (left) return;
      isLooking = false;
      if (found.kind === 'film') {
        location.replace(`#film/${set}`);
        return;
      }
      title.textContent = name;
      const bad = found.photos.filter((photo) => photo.problem);
      const plan = h('div', {});
      const go = h('a', { class: 'button main-button', href: `#key/${set}`, id: 'go-on' }, 'Choose the photo to colour');
      replace(body,
        facts(found),
        found.notes.length > 0 && h('div', { class: 'note' }, h('h2', {}, 'Worth knowing'), h('ul', {}, ...found.notes.map((note) => h('li', {}, note)))),
        bad.length > 0 && problem(`${bad.length === 1 ? 'One photo cannot' : `${bad.length} photos cannot`} be used. Take ${bad.length === 1 ? 'it' : 'them'} out and drop the others again.`),
        plan, h('p', { class: 'row' }, bad.length === 0 && go, mayBeFrames(found) && button('These are the frames of a film', () => void asFilm(), { id: 'as-film' })), found.photos.length > 0 && grid(set, found.photos));
      say(`${found.photos.length} photos found`);
      replace(plan, planTable(await planRun(set, 'fast')));
    } catch (error) {
      if (left) return;
      if (isLooking) replace(body);
      body.append(problem((error as Error).message, h('a', { class: 'button', href: '#' }, 'Drop other photos')));
    }
  };
  void load();
  return () => { left = true; };
};
