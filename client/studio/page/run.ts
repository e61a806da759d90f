// A run: what it is doing, pictures as they come, and its results.
import {
  artifactUrl, cancelJob, describeSet, follow, getRun, getState, previewOfRun, retryJob,
  type PhotoSet, type Run, type Stage,
} from './api';
import { mountCorrector } from './correct/index';
import { bar, button, h, problem, replace, say } from './dom';
import { setStepsOf } from './main';
import { movedTo } from './queue/calls';
import { creditForm, type CreditForm } from './share/credit';
import { sharePanel } from './share/panel';
import { errorInWords, isFinished, seconds, stageName, stateName } from './words';

const previews = 6;
const previewSide = 480;
const tryAgainMs = 5000;

const stageRow = (stage: Stage): HTMLElement => {
  const note = stage.error ?? stage.left_out ?? (stage.state === 'SUCCEEDED'
    ? (stage.cached ? 'known from before' : seconds(stage.seconds)) : stage.state === 'RUNNING' ? stage.message : '');
  const share = bar(stageName(stage.kind));
  if (stage.state === 'RUNNING') share.set(stage.share > 0 ? stage.share : null);
  return h('li', { class: `stage state-${stage.state.toLowerCase()}` },
    h('span', { class: 'mark', 'aria-hidden': true }),
    h('span', { class: 'stage-name' }, stageName(stage.kind), h('span', { class: 'said' }, `: ${stateName(stage.state)}`)),
    h('span', { class: 'soft small stage-note' }, note),
    stage.state === 'RUNNING' && share.element);
};

const overall = (run: Run): number | null => {
  const stages = run.stages.filter((stage) => stage.state !== 'SKIPPED');
  if (!stages.length || run.seconds_left === null) return null;
  const done = stages.reduce((sum, stage) => sum + stage.seconds, 0);
  return done + run.seconds_left > 0 ? done / (done + run.seconds_left) : null;
};

const headline = (run: Run): string => {
  if (run.state === 'SUCCEEDED') return 'Your scene is coloured';
  if (run.state === 'FAILED') return 'This did not work';
  if (run.state === 'CANCELLED') return 'Cancelled';
  return 'Colouring the scene';
};

// The scene, where it can be corrected. `stops`: what to do when the page is left. `onNewest` gets the
// run of each newer version.
const scene = (run: Run, stops: (() => void)[], onNewest: (run: Run) => void): HTMLElement => {
  const frame = (): HTMLElement =>
    h('iframe', { src: artifactUrl(run.id, 'view.html'), sandbox: 'allow-scripts allow-pointer-lock', title: 'The coloured scene', class: 'scene', id: 'scene' });
  const host = h('div', { class: 'corrector' });
  const onVersion = async (id: string): Promise<void> => {
    history.replaceState(null, '', `#job/${id}`);
    const version = await getRun(id);
    if (isFinished(version.state)) onNewest(version);
  };
  stops.push(mountCorrector(host, run.id, (id) => void onVersion(id), () => replace(host, frame())));
  return host;
};

// The coloured photos of a set of which no scene could be made.
const pictures = (run: Run, names: string[], hasScene: boolean): HTMLElement => {
  const title = (name: string): string => name.replace(/^photos\//, '').replace(/\.png$/, '');
  return h('section', { 'aria-labelledby': 'in-colour' },
    h('h2', { id: 'in-colour' }, hasScene ? 'Photos beside the scene' : 'Your photos in colour'),
    h('p', { class: 'soft' }, hasScene
      ? 'They show too little of what the others show to have a place in the scene, so they were coloured as pictures.'
      : 'They show too little in common for a scene to walk through, so each was coloured by itself.'),
    h('ul', { class: 'gallery' }, ...names.map((name) => h('li', {},
      h('a', { href: artifactUrl(run.id, name, true), download: `${title(name)}.png` },
        h('img', { src: artifactUrl(run.id, name), alt: `${title(name)} in colour`, loading: 'lazy' }),
        h('span', { class: 'name' }, title(name)))))));
};

const results = (run: Run, stops: (() => void)[], onNewest: (run: Run) => void): HTMLElement[] => {
  const has = (name: string): boolean => run.artifacts.some((artifact) => artifact.name === name);
  const film = run.artifacts.find(({ name }) => name === 'film.mp4');
  const photos = run.artifacts.filter(({ name }) => name.startsWith('photos/'));
  return [
    ...(has('view.html') ? [scene(run, stops, onNewest)] : []),
    ...(photos.length ? [pictures(run, photos.map(({ name }) => name), has('view.html'))] : []),
    ...(!has('view.html') && film ? [h('p', { class: 'soft' }, 'Save the film to play it.')] : []),
  ];
};

export const showRun = (main: HTMLElement, id: string): (() => void) => {
  const leaves: (() => void)[] = [];
  let left = false, asked = false, finished = false;
  let set: PhotoSet | undefined;
  const title = h('h1', {}, 'Colouring the scene');
  const summary = h('p', { class: 'lead', id: 'summary' });
  const share = bar('The whole run');
  const actions = h('p', { class: 'row' });
  const trouble = h('div', {});
  const result = h('div', { class: 'stack' });
  const gallery = h('ul', { class: 'gallery' });
  const gallerySection = h('section', { 'aria-labelledby': 'first', hidden: true },
    h('h2', { id: 'first' }, 'First colours'),
    h('p', { class: 'soft small' }, 'Quick previews from the key photo. The finished scene is better.'), gallery);
  const stages = h('ol', { class: 'stages' });
  const stageSection = h('details', { open: true, class: 'steps' }, h('summary', {}, 'Steps'), stages);
  replace(main, title, summary, share.element, actions, trouble, result, gallerySection, stageSection);
  let stop = (): void => undefined;

  // Colours some photos as soon as the key photo has its colours.
  const showPreviews = async (run: Run): Promise<void> => {
    const key = run.pictures.find(({ kind, name }) => kind === 'colorize_key_view' && name === 'key_view_colored.png');
    if (!key || asked) return;
    asked = true;
    gallerySection.hidden = false;
    gallery.append(h('li', {}, h('img', { src: artifactUrl(key.job, key.name), alt: 'The coloured key photo' }), h('span', { class: 'name' }, 'Key photo')));
    try {
      const { sets } = await getState();
      set = sets.find((one) => one.scene === run.scene);
      if (!set) return;
      setStepsOf(set.id, 3);
      if (finished) return;
      const { found } = await describeSet(set.id);
      const step = Math.max(1, found.photos.length / previews);
      for (let i = 0; i < previews && Math.floor(i * step) < found.photos.length; ++i) {
        if (left || finished) return;
        const { name } = found.photos[Math.floor(i * step)]!;
        const url = URL.createObjectURL(await previewOfRun(id, set.id, name, previewSide));
        gallery.append(h('li', {}, h('img', { src: url, alt: `${name}, a first guess`, onload: () => URL.revokeObjectURL(url) }), h('span', { class: 'name' }, name)));
      }
    } catch {
      // A preview is not worth a message: the run itself tells what is wrong.
    }
  };

  let shared: HTMLElement | undefined;
  let sharedFiles = '';
  let credit: CreditForm | undefined;
  const showShare = async (run: Run): Promise<void> => {
    try {
      const { sets } = await getState();
      set = sets.find((one) => one.scene === run.scene);
      if (set) setStepsOf(set.id, 3);
    } catch {
      // Without the photos there is still the scene to share.
    }
    if (left) return;
    const files = [run.id, set?.id, ...run.artifacts.map(({ name }) => name)].join('\n');
    if (shared?.isConnected && files === sharedFiles) return;
    sharedFiles = files;
    credit ??= creditForm();
    const focused = document.activeElement;
    const panel = sharePanel(run, set, credit);
    if (shared?.isConnected) shared.replaceWith(panel);
    else result.append(panel);
    shared = panel;
    if (focused instanceof HTMLElement && credit.element.contains(focused)) focused.focus();
  };

  // A run that waited was put elsewhere in the queue, as another one.
  const goWhereMoved = async (): Promise<boolean> => {
    const to = await movedTo(id).catch(() => '');
    if (to && !left) location.replace(`#job/${to}`);
    return !!to;
  };

  const act = async (what: Promise<unknown>, again: boolean): Promise<void> => {
    try {
      await what;
      if (again && !left) showRun(main, id);
    } catch (error) {
      replace(trouble, problem((error as Error).message));
    }
  };

  const show = (run: Run): void => {
    const error = run.stages.find((stage) => stage.error)?.error ?? run.error;
    const isOver = isFinished(run.state);
    title.textContent = headline(run);
    document.title = `${headline(run)} – Color3D Studio`;
    const waits = run.queue_position > 0 ? `Place ${run.queue_position} in the queue. ` : run.waits_for ? `Waits for ${run.waits_for}. ` : '';
    const time = run.seconds_left === null || isOver ? '' : `About ${seconds(run.seconds_left)} left. `;
    const expected = run.expected_error === null ? '' : `Expected colour error ${errorInWords(run.expected_error)}.`;
    summary.textContent = isOver ? expected : waits + time + expected;
    share.element.hidden = isOver;
    share.set(overall(run));
    replace(stages, ...run.stages.map(stageRow));
    replace(actions, !isOver && button('Cancel', () => void act(cancelJob(id), false), { id: 'cancel' }),
      !isOver && h('span', { class: 'soft small' }, 'You may close this page; the work goes on.'),
      ['FAILED', 'CANCELLED'].includes(run.state) && button('Go on from where it stopped', () => { stop(); void act(retryJob(id), true); }, { class: 'main-button' }));
    replace(trouble, run.state === 'FAILED' && error ? problem(error) : null);
    if (!gallery.querySelector('img')) void showPreviews(run);
    const working = run.stages.find((stage) => stage.state === 'RUNNING');
    say(isOver ? headline(run) : working ? stageName(working.kind) : '');
    if (run.state === 'CANCELLED') void goWhereMoved();
    if (run.state !== 'SUCCEEDED' || finished) return;
    finished = true;
    stageSection.open = false;
    gallerySection.hidden = true;
    replace(result, ...results(run, leaves, (newest) => void showShare(newest)));
    void showShare(run);
    main.dataset.state = 'done';
  };
  // Films have a page of their own.
  void getState().then(async ({ sets, jobs }) => {
    const job = jobs.find((one) => one.id === id);
    const own = job && sets.find((one) => one.scene === job.scene);
    if (own && (await describeSet(own.id)).found.kind === 'film' && !left) location.replace(`#film/${own.id}/${id}`);
  }).catch(() => undefined);
  // A service that went away is started again, or comes back: the page goes on by itself.
  let timer: number | undefined;
  const watch = (): void => {
    clearTimeout(timer);
    stop();
    stop = follow(id, {
      run: show,
      problem: (text) => {
        if (left) return;
        void goWhereMoved();
        replace(trouble, problem(text, button('Try again', watch)));
        timer = window.setTimeout(watch, tryAgainMs);
      },
      end: () => undefined,
    });
  };
  void goWhereMoved().then((isElsewhere) => { if (!isElsewhere && !left) watch(); });
  return () => {
    left = true;
    clearTimeout(timer);
    stop();
    for (const leave of leaves) leave();
    document.title = 'Color3D Studio';
    delete main.dataset.state;
  };
};
