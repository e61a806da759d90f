// Everything that a finished scene can be shared as.
import { artifactUrl, type Artifact, type PhotoSet, type Run } from '../api';
import { button, h, problem, replace } from '../dom';
import { bytes } from '../words';
import { framePictureUrl, makeFile, makeMovie, pictureUrl, sideBySideUrl, zipUrl, type Movie } from './calls';
import type { CreditForm } from './credit';
import { adoptShareStyle } from './style';
import { waitFor } from './wait';

const formats: [string, string, string][] = [
  ['sog', 'scene.sog', 'SOG, small, for viewers on the web'],
  ['ply', 'scene.ply', 'PLY, for editors of splats'],
  ['spz', 'scene.spz', 'SPZ, small, for phones'],
  ['glb', 'scene.glb', 'glTF (.glb), for 3D programs'],
];
const paths: [Movie['path'], string, boolean][] = [
  ['orbit', 'around the scene', false],
  ['photos', 'through the photos', false],
  ['still', 'from where the key photo was taken', true],
];
const lengths = [4, 8, 15, 30];
const sizes: [number, string][] = [[0, 'full size'], [3000, '3000 px'], [1600, '1600 px']];

const save = (href: string, text: string, name = ''): HTMLElement => h('a', { class: 'button', href, download: name || true }, text);

const group = (title: string, note: string, ...children: (Node | false)[]): HTMLElement =>
  h('section', { class: 'share-group' }, h('h3', {}, title), h('p', { class: 'soft small' }, note), ...children);

const find = (run: Run, name: string): Artifact | undefined => run.artifacts.find((artifact) => artifact.name === name);

const file = (run: Run, name: string, text: string): HTMLElement | false => {
  const artifact = find(run, name);
  return !!artifact && h('p', { class: 'row' }, save(artifactUrl(run.id, name, true), text, name),
    h('span', { class: 'soft small' }, `${name}, ${bytes(artifact.bytes)}`));
};

const movies = (run: Run): HTMLElement => {
  const moves = !!find(run, 'scene.splat4d');
  const path = h('select', { id: 'movie-path' }, ...paths.filter(([, , moving]) => moves || !moving)
    .map(([value, text]) => h('option', { value }, text)));
  const length = h('select', { id: 'movie-length' }, ...lengths.map((value) =>
    h('option', { value, selected: value === 8 }, `${value} seconds`)));
  const bounce = h('input', { type: 'checkbox', id: 'movie-bounce' });
  const place = h('div', { class: 'share-place' });
  const make = button('Make the movie', () => {
    make.disabled = true;
    const again = (): void => { make.disabled = false; };
    makeMovie(run.id, { path: path.value as Movie['path'], seconds: Number(length.value), bounce: bounce.checked }).then((job) =>
      waitFor(job.id, 'Making the movie', place, () => {
        again();
        replace(place, h('p', { class: 'row' },
          save(artifactUrl(job.id, 'scene.mp4', true), 'Save the movie', 'scene.mp4'),
          save(sideBySideUrl(job.id, 'scene.mp4'), 'Save it beside grey')));
      }), (error: Error) => {
      again();
      replace(place, problem(error.message));
    });
  }, { id: 'make-movie' });
  return group('Movie', 'A camera that flies, as MP4 for any player. Also side by side with the same movie in grey.',
    h('p', { class: 'row' }, h('label', { for: 'movie-path' }, 'Camera'), path, h('label', { for: 'movie-length', class: 'said' }, 'Length'), length),
    h('label', { class: 'share-check' }, bounce, ' there and back'),
    h('p', { class: 'row' }, make), place);
};

// The movie of a film in colour; scenes have a turntable as scene.mp4.
const filmOf = (run: Run): string | undefined =>
  ['film.mp4', ...(find(run, 'view.html') ? [] : ['scene.mp4'])].find((name) => find(run, name));

const film = (run: Run, name: string): HTMLElement => group('Film', 'The whole film in colour, with its sound; or beside itself in grey.',
  file(run, name, 'Save the film'), h('p', { class: 'row' }, save(sideBySideUrl(run.id, name), 'Save it beside grey')));

// Addresses follow the credit, which the studio must have kept before a picture is saved.
const pictures = (
  run: Run, set: PhotoSet | undefined, form: CreditForm, shownFrame: (() => number) | undefined,
): { element: HTMLElement; refresh: () => void } => {
  const movie = filmOf(run);
  const row = h('div', {});
  const size = h('select', { id: 'zip-size', onchange: () => refresh() }, ...sizes.map(([value, text]) => h('option', { value }, text)));
  const link = (href: () => string, text: string, name = ''): HTMLElement => {
    const anchor = save(href(), text, name) as HTMLAnchorElement;
    anchor.addEventListener('click', (event) => {
      if (anchor.dataset.kept) return delete anchor.dataset.kept;
      event.preventDefault();
      return void form.kept().then(() => {
        anchor.href = href();
        anchor.dataset.kept = '1';
        anchor.click();
      });
    });
    return anchor;
  };
  const refresh = (): void => {
    const caption = form.wantsCaption();
    const key = find(run, 'key_view_colored.png');
    replace(row,
      key && h('p', { class: 'row' }, link(() => pictureUrl(run.id, key.name, caption), movie ? 'Save the coloured frame' : 'Save the key photo', key.name)),
      !!movie && !!shownFrame && h('p', { class: 'row' },
        link(() => framePictureUrl(run.id, movie, shownFrame(), caption), 'Save the frame that is shown')),
      !!set && !movie && h('p', { class: 'row' },
        link(() => zipUrl(run.id, set.id, Number(size.value), caption), 'Save all photos in colour'),
        h('label', { for: 'zip-size', class: 'said' }, 'Size of the photos'), size),
      !!set && !movie && h('p', { class: 'soft small' }, 'A ZIP of JPEGs. It comes when all are ready: about a second each.'));
  };
  refresh();
  return {
    element: group('Pictures', 'With names, original and licence inside.', row,
      h('p', { class: 'row' }, h('a', { class: 'button', href: `#sheet/${run.id}`, id: 'go-sheet' }, 'Contact sheet for print'))),
    refresh,
  };
};

const others = (run: Run): HTMLElement => {
  const rows = formats.map(([format, name, text]) => {
    const place = h('div', { class: 'share-place' });
    const ready = (job: string): HTMLElement => h('p', { class: 'row' }, save(artifactUrl(job, name, true), 'Save', name), h('span', { class: 'small share-format' }, text));
    if (find(run, name)) {
      replace(place, ready(run.id));
    } else {
      const make = button('Make', () => {
        makeFile(run.id, format).then((job) => waitFor(job.id, `Writing ${name}`, place, () => replace(place, ready(job.id))),
          (error: Error) => replace(place, problem(error.message)));
      }, { 'data-format': format });
      replace(place, h('p', { class: 'row' }, make, h('span', { class: 'small share-format' }, text)));
    }
    return place;
  });
  return group('For other programs', 'The scene in the formats of viewers and editors.', ...rows);
};

// `form`: the page's own. `shownFrame`: of a film, the number of the frame that the page shows.
export const sharePanel = (run: Run, set: PhotoSet | undefined, form: CreditForm, shownFrame?: () => number): HTMLElement => {
  adoptShareStyle();
  const shown = pictures(run, set, form, shownFrame), movie = filmOf(run);
  form.changed = shown.refresh;
  const has = (name: string): boolean => !!find(run, name);
  return h('section', { class: 'share', 'aria-labelledby': 'share-title' },
    h('h2', { id: 'share-title' }, 'Share it'),
    form.element,
    h('div', { class: 'share-groups' },
      has('view.html') && group('One page for any browser', 'Send this one file: it needs no program and no network.',
        file(run, 'view.html', 'Save the page'), file(run, 'report.html', 'Save the report')),
      !!movie && film(run, movie),
      !has('view.html') && has('report.html') && group('The report', 'Where colours are seen, inferred and guessed, as one page.',
        file(run, 'report.html', 'Save the report')),
      has('view.html') && movies(run),
      shown.element,
      (has('scene.ply') || has('scene.sog')) && others(run)));
};
