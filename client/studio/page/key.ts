// Which photo is coloured, and with what.
import {
  colorize, describeSet, follow, getState, keepPicture, keyViews, photoUrl, previewStrokes, selectKey,
  type Choices, type Found, type KeyChoice, type KeyViews, type Run,
} from './api';
import { bar, button, h, problem, replace, say } from './dom';
import { furtherKeys } from './keys/further_keys';
import { asChoices } from './keys/key_list';
import { Painter, type StrokeFile } from './paint/index';
import { errorInWords, seconds, stageName } from './words';

type Way = Choices['color'];
const maxChosen = 4;

// Selections that are known, so that going back and forth asks once.
const chosen = new Map<string, KeyViews>();

const select = async (set: string, found: Found, show: (run: Run) => void, stops: (() => void)[]): Promise<KeyViews> => {
  const known = chosen.get(set);
  if (known) return known;
  const count = found.kind === 'photos' ? Math.min(maxChosen, found.photos.length) : 1;
  const job = await selectKey(set, count);
  await new Promise<void>((done, failed) => {
    let last: Run | undefined;
    stops.push(follow(job.id, {
      run: (run) => { last = run; show(run); },
      problem: (text) => failed(new Error(text)),
      end: () => {
        const blamed = last?.stages.find((stage) => stage.error);
        if (last?.state === 'SUCCEEDED') done();
        else failed(new Error(blamed?.error ?? last?.error ?? 'The photo to colour could not be chosen.'));
      },
    }));
  });
  const views = await keyViews(job.id);
  chosen.set(set, views);
  return views;
};

const reason = ({ view, description, views }: KeyViews): string => {
  const error = views[0]?.expected_error ?? null;
  if (error === null) return `Proposed: ${view}. ${description}`;
  const second = views[1]?.expected_error ?? null;
  return `Proposed: ${view}, because its colours reach most of the other photos. Expected colour error ${errorInWords(error)}`
    + (second === null || error - second < 0.05 ? '.' : `; ${second.toFixed(1)} with ${views[1]!.name} coloured as well.`);
};

export const showKey = (main: HTMLElement, set: string): (() => void) => {
  const stops: (() => void)[] = [];
  let left = false;
  let view = '', way: Way = 'automatic', picture = '';
  let strokes: StrokeFile = [];
  let painter: Painter | undefined;
  const waiting = bar('Choosing the photo');
  const doing = h('p', { class: 'soft' }, 'Looking at the photos …');
  const body = h('div', { class: 'stack' }, h('div', { class: 'panel' }, doing, waiting.element));
  replace(main, h('h1', {}, 'Colour one photo'), body);

  const endPainter = (): void => {
    painter?.destroy();
    painter = undefined;
  };

  const build = (found: Found, views: KeyViews, presets: string[]): void => {
    const stage = h('div', { class: 'key-stage' });
    const name = h('p', { class: 'key-name' });
    const problems = h('div', {});
    const mount = async (): Promise<void> => {
      endPainter();
      const isPhoto = found.photos.some((photo) => photo.name === view);
      const image = h('img', { id: 'key-photo', alt: `The photo ${view}`, ...(isPhoto ? { src: photoUrl(set, view, 1600, way !== 'picture') } : {}) });
      replace(stage, isPhoto ? image : h('p', { class: 'soft' }, view || 'The service chooses it.'));
      if (way !== 'strokes' || !isPhoto) return;
      const response = await fetch(photoUrl(set, view, 0, true));
      const photo = await createImageBitmap(await response.blob());
      if (left || (way as Way) !== 'strokes') return;
      const host = h('div', { class: 'painter', id: 'painter' });
      replace(stage, host);
      painter = new Painter(host, {
        photo,
        preview: (now, side, signal) => previewStrokes(set, view, now, side, signal),
        onChange: (now) => { strokes = now; },
      });
      if (strokes.length) painter.load(strokes);
    };

    const keyNow = (): KeyChoice => {
      if (painter) strokes = painter.strokes();
      if (way === 'strokes' && !strokes.length) throw new Error('Draw a stroke first, or choose automatic colours.');
      if (way === 'picture' && !picture) throw new Error('Bring the coloured picture first.');
      return { key_view: view, color: way, ...(way === 'picture' ? { picture } : {}), ...(way === 'strokes' ? { strokes } : {}) };
    };
    const also = furtherKeys<KeyChoice>({
      set, key: keyNow, proposed: views.views.map(({ name }) => name), photos: found.photos.map(({ name }) => name),
      go: (next, kept) => {
        choose(next);
        if (!kept) return;
        picture = kept.picture ?? '';
        strokes = (kept.strokes ?? []) as StrokeFile;
        const radio = wayChoice.querySelector<HTMLInputElement>(`input[value=${kept.color}]`);
        if (radio) radio.checked = true;
        pickWay(kept.color);
      },
      problem: (text) => replace(problems, text !== null && problem(text)),
    });

    const choose = (next: string): void => {
      if (next !== view) strokes = [];
      view = next;
      picture = '';
      name.textContent = view;
      for (const item of options.querySelectorAll('button')) {
        item.setAttribute('aria-pressed', String(item.dataset.view === view));
      }
      void mount();
    };
    const option = (row: KeyViews['views'][number], i: number): HTMLElement => {
      const saves = row.saves ?? 0;
      const why = i === 0 ? 'proposed' : saves < 0.05 ? 'would add little' : `as well: error down by ${saves.toFixed(1)}`;
      return h('li', {}, h('button', { type: 'button', 'data-view': row.name, 'aria-pressed': 'false', class: 'key-option', onclick: () => choose(row.name) },
        found.photos.length > 0 && h('img', { src: photoUrl(set, row.name, 240), alt: '' }),
        h('span', { class: 'name' }, row.name), h('span', { class: 'small soft' }, why)));
    };
    const others = h('select', { id: 'other-view', onchange: (event) => choose((event.currentTarget as HTMLSelectElement).value) },
      h('option', { value: '' }, 'another photo …'), ...found.photos.map((photo) => h('option', { value: photo.name }, photo.name)));
    const options = h('ul', { class: 'key-options' }, ...views.views.map(option));

    const ways: [Way, string, string][] = [
      ['automatic', 'Automatic', 'The program guesses sky, plants, skin and wood. It cannot know the colour of a coat.'],
      ['strokes', 'Paint', 'Give a few things their colour; it spreads up to their edges.'],
      ['picture', 'A picture I coloured', 'Save the photo, colour it in a paint program, and bring it back in the same size.'],
    ];
    const detail = h('div', { class: 'way-detail' });
    const pickWay = (next: Way): void => {
      way = next;
      const [, , text] = ways.find(([value]) => value === way)!;
      const pictureInput = h('input', { type: 'file', accept: 'image/*', id: 'colored-picture', class: 'said', onchange: (event) => void bring(event) });
      replace(detail, h('p', { class: 'soft' }, text), way === 'picture' && h('p', { class: 'row' },
        h('a', { class: 'button', href: photoUrl(set, view), download: view.replace(/^.*\//, '').replace(/\.[^.]*$/, '.jpg') }, 'Save the photo'),
        h('span', { class: 'file-choice' }, pictureInput, h('label', { for: 'colored-picture', class: 'button' }, 'Bring the coloured picture')),
        h('span', { id: 'brought', class: 'soft', role: 'status' })));
      void mount();
    };
    const bring = async (event: Event): Promise<void> => {
      const file = (event.currentTarget as HTMLInputElement).files?.[0];
      if (!file) return;
      try {
        const kept = await keepPicture(set, file);
        picture = kept.picture;
        document.getElementById('brought')!.textContent = `${file.name}, ${kept.width} × ${kept.height}`;
        const url = URL.createObjectURL(file);
        replace(stage, h('img', { src: url, alt: 'The photo as you coloured it', onload: () => URL.revokeObjectURL(url) }));
        replace(problems);
      } catch (error) {
        replace(problems, problem((error as Error).message));
      }
    };
    const wayChoice = h('fieldset', { class: 'choices' }, h('legend', {}, 'Its colours'),
      ...ways.map(([value, label]) => h('label', {},
        h('input', { type: 'radio', name: 'way', value, checked: value === way, onchange: () => pickWay(value) }), ` ${label}`)));

    const presetWords: Record<string, string> = { fast: 'Fast', best: 'Best, takes several times as long' };
    const preset = h('select', { id: 'preset' }, ...presets.filter((value) => presetWords[value])
      .map((value) => h('option', { value }, presetWords[value]!)));
    const poses = h('input', { type: 'checkbox', id: 'poses' });
    const start = button('Colour the scene', () => void run(), { class: 'main-button', id: 'start' });
    const run = async (): Promise<void> => {
      start.disabled = true;
      try {
        const job = await colorize(set, { preset: preset.value || 'fast', poses: poses.checked, ...asChoices(also.all()) });
        location.hash = `job/${job.id}`;
      } catch (error) {
        start.disabled = false;
        replace(problems, problem((error as Error).message));
      }
    };
    replace(body,
      h('p', { class: 'lead' }, reason(views)),
      h('div', { class: 'key-layout' },
        h('div', { class: 'key-main' }, name, stage,
          h('section', { 'aria-labelledby': 'which' }, h('h2', { id: 'which' }, 'Which photo'), options,
            found.photos.length > 1 && h('p', {}, h('label', { for: 'other-view', class: 'said' }, 'Another photo'), others),
            found.photos.length > 1 && also.root)),
        h('div', { class: 'key-side panel' },
          wayChoice, detail, problems,
          h('p', { class: 'row' }, h('label', { for: 'preset' }, 'Quality'), preset),
          found.kind === 'film' && h('label', { class: 'choice' }, poses, ' Also a scene in 3D: finds how the camera moved, and takes several times as long'),
          h('p', {}, start))));
    choose(views.view);
    pickWay(way);
    say(`The proposed photo is ${views.view}`);
  };

  const load = async (): Promise<void> => {
    try {
      const [{ found }, { server }] = await Promise.all([describeSet(set), getState()]);
      const views = await select(set, found, (run) => {
        const now = run.stages.find((stage) => stage.state === 'RUNNING') ?? run.stages.find((stage) => stage.state !== 'SUCCEEDED');
        doing.textContent = now ? `${stageName(now.kind)} …${now.seconds_left > 1 ? ` about ${seconds(now.seconds_left)} left` : ''}` : 'Choosing the photo to colour …';
        say(doing.textContent);
        waiting.set(now && now.share > 0 ? now.share : null);
      }, stops);
      if (!left) build(found, views, server.presets);
    } catch (error) {
      if (!left) replace(body, problem((error as Error).message, button('Try again', () => showAgain())));
    }
  };
  const showAgain = (): void => {
    replace(body, h('div', { class: 'panel' }, doing, waiting.element));
    void load();
  };
  void load();
  return () => {
    left = true;
    for (const stop of stops) stop();
    endPainter();
  };
};
