// Which photo is coloured, and with what.
import {
  colorize, describeSet, follow, getState, keyViews, photoUrl, previewColors, selectKey,
  type Colors, type Found, type KeyChoice, type KeyViews, type Run,
} from './api';
import { bar, button, h, problem, replace, say } from './dom';
import { colorSources } from './key_colors';
import { furtherKeys } from './keys/further_keys';
import { asChoices } from './keys/key_list';
import { Painter, serializeStrokes, type StrokeFile } from './paint/index';
import { errorInWords, seconds, stageName } from './words';

const shownSide = 1000; // px of previews
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
  let view = '';
  const strokesOf = new Map<string, StrokeFile>(); // by photo
  let painter: Painter | undefined;
  const waiting = bar('Choosing the photo');
  const doing = h('p', { class: 'soft' }, 'Looking at the photos …');
  const body = h('div', { class: 'stack' }, h('div', { class: 'panel' }, doing, waiting.element));
  replace(main, h('h1', {}, 'Colour one photo'), body);

  const endPainter = (): void => {
    painter?.destroy();
    painter = undefined;
  };

  const build = (found: Found, views: KeyViews, presets: string[], knowsWords: boolean): void => {
    const stage = h('div', { class: 'key-stage' });
    const name = h('p', { class: 'key-name' });
    const problems = h('div', {});
    const told = h('p', { class: 'soft small', role: 'status', id: 'told' });
    const showProblem = (text: string | null): void => replace(problems, text !== null && problem(text));
    const photoOf = (wanted: string) => found.photos.find((photo) => photo.name === wanted);
    const withStrokes = (colors: Colors, strokes: StrokeFile | undefined): Colors =>
      strokes?.length ? { ...colors, strokes: serializeStrokes(strokes) } : colors;
    const sources = colorSources({
      set, knowsWords, view: () => view, problem: showProblem, change: () => void showBelow(),
      size: () => {
        const { width, height } = photoOf(view) ?? {};
        return width && height ? { width, height } : undefined;
      },
    });

    // The photo in the colours that lie below the strokes, as soon as there are any.
    let below: Blob | undefined, turn = 0;
    let asking: AbortController | undefined;
    const showBelow = async (): Promise<void> => {
      const mine = ++turn;
      asking?.abort();
      below = undefined;
      await putBelow();
      const colors = sources.seen();
      if (!colors || !photoOf(view)) return;
      told.textContent = 'Its colours are being made …';
      asking = new AbortController();
      try {
        const picture = await previewColors(set, view, colors, shownSide, asking.signal);
        if (left || mine !== turn) return;
        below = picture;
        await putBelow();
        told.textContent = '';
      } catch (error) {
        if (left || mine !== turn) return;
        told.textContent = '';
        showProblem((error as Error).message);
      }
    };
    const putBelow = async (): Promise<void> => {
      if (painter) {
        painter.setAutomatic(below ? await createImageBitmap(below) : null);
        return;
      }
      const image = stage.querySelector<HTMLImageElement>('#key-photo');
      if (!image) return;
      const url = below ? URL.createObjectURL(below) : photoUrl(set, view, 1600, true);
      image.onload = () => URL.revokeObjectURL(url);
      image.src = url;
      image.alt = below ? `The photo ${view} in its colours` : `The photo ${view}`;
    };

    const showStill = (): void => {
      endPainter();
      paint.setAttribute('aria-pressed', 'false');
      replace(stage, photoOf(view) ? h('img', { id: 'key-photo', alt: `The photo ${view}`, src: photoUrl(set, view, 1600, true) })
        : h('p', { class: 'soft' }, view || 'The service chooses it.'));
      void putBelow();
    };
    const showPainter = async (): Promise<void> => {
      const mine = view;
      const response = await fetch(photoUrl(set, view, 0, true));
      const photo = await createImageBitmap(await response.blob());
      if (left || mine !== view) return;
      endPainter();
      const host = h('div', { class: 'painter', id: 'painter' });
      replace(stage, host);
      painter = new Painter(host, {
        photo,
        preview: async (now, side, signal) =>
          createImageBitmap(await previewColors(set, mine, withStrokes(sources.seen() ?? { color: 'nothing' }, now), side, signal)),
        onChange: (now) => strokesOf.set(mine, now),
      });
      const strokes = strokesOf.get(mine);
      if (strokes?.length) painter.load(strokes);
      paint.setAttribute('aria-pressed', 'true');
      await putBelow();
    };
    const paint = button('Paint on the photo', () => {
      if (painter) showStill();
      else showPainter().catch((error: Error) => showProblem(error.message));
    }, { id: 'paint', 'aria-pressed': 'false' });

    // At full size, as a run colours it.
    const save = button('Save the coloured picture', () => void savePicture(), { id: 'save-picture' });
    const savePicture = async (): Promise<void> => {
      save.disabled = true;
      told.textContent = 'The picture is being made in full size …';
      try {
        const colors = withStrokes(sources.seen() ?? sources.now(), strokesOf.get(view));
        const url = URL.createObjectURL(await previewColors(set, view, colors, 0));
        h('a', { href: url, download: `${view.replace(/^.*\//, '').replace(/\.[^.]*$/, '')}_coloured.png` }).click();
        setTimeout(() => URL.revokeObjectURL(url), 10000);
        showProblem(null);
      } catch (error) {
        showProblem((error as Error).message);
      }
      told.textContent = '';
      save.disabled = false;
    };

    const also = furtherKeys<KeyChoice>({
      set, proposed: views.views.map(({ name }) => name), photos: found.photos.map(({ name }) => name),
      key: () => ({ key_view: view, ...withStrokes(sources.now(), strokesOf.get(view)) }),
      go: (next, kept) => {
        choose(next);
        if (kept) sources.restore(kept);
      },
      problem: showProblem,
    });

    const choose = (next: string): void => {
      view = next;
      name.textContent = view;
      for (const item of options.querySelectorAll('button')) {
        item.setAttribute('aria-pressed', String(item.dataset.view === view));
      }
      paint.disabled = save.disabled = !photoOf(view);
      sources.forget();
      showStill();
      void showBelow();
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
    const allowFile = (event: Event): void => event.preventDefault();
    const dropFile = (event: Event): void => {
      event.preventDefault();
      const file = (event as DragEvent).dataTransfer?.files[0];
      if (file && photoOf(view)) void sources.take(file);
    };
    replace(body,
      h('p', { class: 'lead' }, reason(views)),
      h('div', { class: 'key-layout' },
        h('div', { class: 'key-main', ondragover: allowFile, ondrop: dropFile }, name, stage,
          h('p', { class: 'row key-actions' }, paint, save), told,
          h('section', { 'aria-labelledby': 'which' }, h('h2', { id: 'which' }, 'Which photo'), options,
            found.photos.length > 1 && h('p', {}, h('label', { for: 'other-view', class: 'said' }, 'Another photo'), others),
            found.photos.length > 1 && also.root)),
        h('div', { class: 'key-side panel' },
          sources.root, problems,
          h('p', { class: 'row' }, h('label', { for: 'preset' }, 'Quality'), preset),
          found.kind === 'film' && h('label', { class: 'choice' }, poses, ' Also a scene in 3D: finds how the camera moved, and takes several times as long'),
          h('p', {}, start))));
    choose(views.view);
    stops.push(() => {
      sources.stop();
      asking?.abort();
    });
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
      if (!left) build(found, views, server.presets, server.knows_words);
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
