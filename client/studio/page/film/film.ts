// The page of a film: what was found, its timeline, and its colours as they come (#film/SET and #film/SET/JOB).
import {
  artifactUrl, cancelJob, describeSet, follow, getState, keyViews, planRun, previewOfRun, retryJob, selectKey,
  type Found, type Job, type KeyViews, type PhotoSet, type Run,
} from '../api';
import { bar, button, h, problem, replace, say } from '../dom';
import { creditForm } from '../share/credit';
import { sharePanel } from '../share/panel';
import { bytes, day, errorInWords, isFinished, seconds, stageName, stateName } from '../words';
import {
  changeFilm, colorizeFilm, describeFilm, earlyUrl, filmUrl, frameUrl, movieFrameUrl, movieUrl, setAsFrames, timelineOf, type FilmFacts, type JobTimeline,
} from './film_api';
import { FilmPlan } from './film_plan';
import type { FilmSource } from './screen';
import { adoptFilmStyle } from './style';
import type { Proposal } from './timeline';
import { clockOf, evenTimes, frameOfName, runsOf, type FilmTimes } from './timeline_model';
import { Workspace } from './workspace';

const mostKeys = 4; // that are proposed before the first run
const earlySide = 960, pictureSide = 160; // px

// Selections that are known, so that going back and forth asks once.
const selections = new Map<string, { job: string; views: KeyViews }>();

const firstTimes = (found: Found, facts: FilmFacts): FilmTimes => {
  const name = (i: number): string => facts.is_video ? `f${String(i).padStart(6, '0')}.png` : found.photos[i]?.name ?? String(i);
  return {
    names: Array.from({ length: facts.frames }, (_, i) => name(i)),
    times: evenTimes(facts.frames, facts.frames_per_second),
    shots: new Array<number>(facts.frames).fill(0),
  };
};

const factsOf = (facts: FilmFacts, shots: number | null): string => [
  `${facts.frames} frames, ${facts.seconds < 60 ? `${facts.seconds.toFixed(1)} s` : clockOf(Math.round(facts.seconds), false)}`,
  `${Number(facts.frames_per_second.toFixed(2))} a second`,
  `${facts.width} × ${facts.height}`,
  facts.in_color === null ? '' : facts.in_color ? 'in colour (its own colours are not used)' : 'monochrome',
  facts.has_sound ? 'with sound' : 'silent',
  shots === null ? '' : shots === 1 ? 'one shot' : `${shots} shots`,
].filter(Boolean).join(' · ');

// What a stage does, said of a film.
const doing = (kind: string): string => kind === 'import_scene' ? 'Look for shots'
  : stageName(kind).replace('photos', 'frames').replace('photo', 'frame').replace('scene', 'film');

export const showFilm = (main: HTMLElement, set: string): (() => void) => {
  adoptFilmStyle();
  const job = location.hash.split('/')[2] ?? '';
  let left = false;
  let workspace: Workspace | undefined;
  let plan: FilmPlan | undefined;
  let facts: FilmFacts;
  let found: Found;
  let photoSet: PhotoSet | undefined;
  let proposals: Proposal[] = [];
  let run: Run | undefined;
  let finished: JobTimeline | undefined;
  const stops: (() => void)[] = [];
  const title = h('h1', {}, 'Film');
  const summary = h('p', { class: 'soft film-facts', id: 'film-facts' });
  const notes = h('div', {});
  const body = h('div', { class: 'film-body' });
  const more = h('div', { class: 'stack' });
  replace(main, title, summary, notes, body, more);

  // ---- the side: what is going on, and the next thing to do ------------------------------------
  const status = h('p', { class: 'soft', id: 'film-status' });
  const share = bar('Progress');
  share.element.hidden = true;
  const trouble = h('div', {});
  const preset = h('select', { id: 'preset' });
  const poses = h('input', { type: 'checkbox', id: 'film-poses' });
  const steady = h('input', { type: 'checkbox', id: 'film-steady' });
  const rate = h('input', { type: 'number', id: 'film-rate', min: 1, max: 120, step: 'any', value: 25 });
  const options = h('details', { class: 'film-options' }, h('summary', {}, 'Options'));
  const start = button('Colour the film', () => void send(), { class: 'main-button', id: 'film-start' });
  const actions = h('p', { class: 'row' });
  const undo = button('Undo', () => plan?.undo(), { id: 'film-undo', 'aria-keyshortcuts': 'Control+Z' });
  const redo = button('Redo', () => plan?.redo(), { id: 'film-redo' });
  const changes = h('p', { class: 'row', hidden: true }, undo, redo);
  const wishes = h('div', { class: 'panel', id: 'film-wishes' }, status, share.element, trouble, changes, options, actions, h('p', { hidden: true }, start));

  const updateActions = (): void => {
    const isOver = !run || isFinished(run.state);
    start.parentElement!.hidden = !plan || !isOver || plan.keys.length === 0 || (job !== '' && !plan.isChanged());
    start.textContent = job ? 'Colour again with these changes' : 'Colour the film';
    changes.hidden = !plan || !(plan.canUndo || plan.canRedo);
    undo.disabled = !plan?.canUndo;
    redo.disabled = !plan?.canRedo;
  };
  const changed = (): void => {
    workspace?.update();
    updateActions();
  };

  const send = async (): Promise<void> => {
    if (!plan) return;
    const missing = plan.missing();
    if (missing) return replace(trouble, problem(missing));
    start.disabled = true;
    try {
      const colors = plan.toBody();
      const next = job ? await changeFilm(set, job, colors) : await colorizeFilm(set, {
        ...colors, preset: preset.value || 'fast', poses: poses.checked, steady_exposure: steady.checked,
        ...(facts.is_video ? {} : { frames_per_second: Number(rate.value) || 25 }),
      });
      location.hash = `film/${set}/${next.id}`;
    } catch (error) {
      replace(trouble, problem((error as Error).message));
    }
    start.disabled = false;
  };

  // ---- the film --------------------------------------------------------------------------------
  const grayFilm = (film: FilmTimes): FilmSource => ({
    video: facts.is_video ? filmUrl(set) : null,
    frame: (frame, side) => frameUrl(set, film.names[frame]!, side, true),
    isColored: false, isGray: facts.in_color === false,
  });
  const movieName = (): string | undefined =>
    ['film.mp4', 'scene.mp4'].find((name) => run?.artifacts.some((artifact) => artifact.name === name));
  const coloredFilm = (film: FilmTimes): FilmSource => {
    const name = movieName();
    return name && run?.state === 'SUCCEEDED' ? {
      video: movieUrl(job, name), frame: (frame, side) => movieFrameUrl(job, name, frame, side), isColored: true, isGray: false,
    } : grayFilm(film);
  };
  const build = (film: FilmTimes): void => {
    const now = workspace?.now ?? 0;
    workspace?.destroy();
    const source = coloredFilm(film);
    const isReady = run?.state === 'SUCCEEDED';
    workspace = new Workspace({
      set, facts, plan: () => plan!, proposals, source,
      allowsParts: isReady && finished?.poses === false,
      whyNoParts: !isReady ? '' : finished?.poses ? 'This film has become a scene in 3D. Parts in other colours are for films without it.' : '',
      pictures: () => source.isColored ? { name: 'colored', address: (frame) => source.frame(frame, pictureSide) }
        : isWorking() ? { name: 'early', address: (frame) => earlyUrl(job, set, film.names[frame]!, pictureSide) }
          : { name: 'gray', address: (frame) => frameUrl(set, film.names[frame]!, pictureSide, true) },
      onPause: (frame) => void showEarly(frame),
      side: [wishes],
    });
    replace(body, workspace.root);
    if (now) workspace.seek(Math.min(now, film.times.length - 1));
    updateActions();
  };

  // First colours while the run goes on: of the frame that stands, and of the small pictures.
  let hasFirstColors = false, early: string | null = null;
  const dropEarly = (): void => {
    if (early) URL.revokeObjectURL(early);
    early = null;
  };
  const isWorking = (): boolean => !left && hasFirstColors && run !== undefined && !isFinished(run.state);
  const showEarly = async (frame: number): Promise<void> => {
    if (!isWorking() || !plan) return;
    try {
      const picture = await previewOfRun(job, set, plan.film.names[frame]!, earlySide);
      if (!isWorking() || workspace?.now !== frame || workspace.screen.isPlaying) return;
      dropEarly();
      early = URL.createObjectURL(picture);
      workspace.screen.showEarly(early);
    } catch {
      // A preview is not worth a message: the run itself tells what is wrong.
    }
  };
  const showFirstColors = (): void => {
    if (hasFirstColors || !workspace) return;
    hasFirstColors = true;
    workspace.showPictures();
    void showEarly(workspace.now);
  };

  // ---- before the first run --------------------------------------------------------------------
  const waitFor = (started: Job): Promise<void> => new Promise((done, failed) => {
    let last: Run | undefined;
    stops.push(follow(started.id, {
      run: (next) => {
        last = next;
        const now = next.stages.find((stage) => stage.state === 'RUNNING');
        status.textContent = now ? `${doing(now.kind)} …` : 'Waiting …';
        share.set(now && now.share > 0 ? now.share : null);
      },
      problem: (text) => failed(new Error(text)),
      end: () => last?.state === 'SUCCEEDED' ? done()
        : failed(new Error(last?.stages.find((stage) => stage.error)?.error ?? last?.error ?? 'The frame to colour could not be chosen.')),
    }));
  });
  const select = async (): Promise<void> => {
    let known = selections.get(set);
    if (!known) {
      status.textContent = 'Looking for shots, and for the frame to colour …';
      share.element.hidden = false;
      share.set(null);
      const started = await selectKey(set, mostKeys);
      await waitFor(started);
      known = { job: started.id, views: await keyViews(started.id) };
      selections.set(set, known);
    }
    const film = await timelineOf(known.job);
    if (left) return;
    share.element.hidden = true;
    const { views } = known;
    const first = Math.max(0, frameOfName(film.names, views.view));
    proposals = views.views.slice(1).map(({ name, saves }) => ({
      frame: frameOfName(film.names, name),
      text: saves !== null && saves >= 0.05 ? `the expected colour error falls by ${saves.toFixed(1)}` : 'would add little',
    })).filter(({ frame }) => frame >= 0);
    plan = new FilmPlan(film, { keys: [{ frame: first, way: 'automatic' }], parts: [] }, changed);
    summary.textContent = factsOf(facts, runsOf(film.shots).length);
    const error = views.views[0]?.expected_error ?? null;
    status.textContent = `Proposed: the frame at ${clockOf(film.times[first]!)}. ${error === null ? views.description : `Expected colour error ${errorInWords(error)}.`}`;
    say(status.textContent);
    build(film);
    workspace?.seek(first);
    main.dataset.state = 'chosen';
  };
  const showOptions = (presets: string[]): void => {
    const words: Record<string, string> = { fast: 'Fast', best: 'Best, takes several times as long' };
    replace(preset, ...presets.filter((value) => words[value]).map((value) => h('option', { value }, words[value]!)));
    options.append(
      h('p', { class: 'row' }, h('label', { for: 'preset' }, 'Quality'), preset),
      ...(facts.is_video ? [] : [h('label', { for: 'film-rate' }, 'Frames a second', rate)]),
      h('label', {}, steady, h('span', {}, 'Steady the exposure, for old film that flickers')),
      h('label', {}, poses, h('span', {}, 'Build the place in 3D, too, as a scene that moves. The camera should move; takes minutes')));
  };

  // ---- a run -----------------------------------------------------------------------------------
  const showPlan = async (): Promise<void> => {
    const expected = await planRun(set, 'fast');
    if (!left && expected.seconds > 0) options.before(h('p', { class: 'soft small' }, `About ${seconds(expected.seconds)} and ${bytes(expected.bytes)} of memory`));
  };
  const showState = (next: Run): void => {
    const error = next.stages.find((stage) => stage.error)?.error ?? next.error;
    const isOver = isFinished(next.state);
    const working = next.stages.find((stage) => stage.state === 'RUNNING');
    const waits = next.queue_position > 0 ? `Place ${next.queue_position} in the queue. ` : next.waits_for ? `Waits for ${next.waits_for}. ` : '';
    const time = next.seconds_left === null || isOver ? '' : ` About ${seconds(next.seconds_left)} left.`;
    status.textContent = isOver ? (next.state === 'SUCCEEDED' ? 'The film is coloured.' : `${stateName(next.state)}.`)
      : `${waits}${working ? doing(working.kind) : 'Getting ready'} …${time}`;
    document.title = `${title.textContent} – Color3D Studio`;
    share.element.hidden = isOver;
    const stages = next.stages.filter((stage) => stage.state !== 'SKIPPED');
    const done = stages.reduce((sum, stage) => sum + stage.seconds, 0);
    share.set(next.seconds_left !== null && done + next.seconds_left > 0 ? done / (done + next.seconds_left) : null);
    replace(actions,
      !isOver && button('Cancel', () => void act(cancelJob(job)), { id: 'cancel' }),
      !isOver && h('span', { class: 'soft small' }, 'You may close this page; the work goes on.'),
      ['FAILED', 'CANCELLED'].includes(next.state) && button('Go on from where it stopped', () => void act(retryJob(job), true), { class: 'main-button' }));
    replace(trouble, next.state === 'FAILED' && error ? problem(error) : null);
    say(isOver || !working ? status.textContent : doing(working.kind));
  };
  const act = async (what: Promise<unknown>, again = false): Promise<void> => {
    try {
      await what;
      if (again && !left) dispatchEvent(new HashChangeEvent('hashchange'));
    } catch (error) {
      replace(trouble, problem((error as Error).message));
    }
  };
  const showResults = async (jobs: Job[]): Promise<void> => {
    if (!run) return;
    const has = (name: string): boolean => run!.artifacts.some((artifact) => artifact.name === name);
    const others = jobs.filter((one) => one.scene === run!.scene && one.id !== job && one.state === 'SUCCEEDED');
    replace(more,
      has('view.html') && h('section', { 'aria-labelledby': 'in-3d' }, h('h2', { id: 'in-3d' }, 'The scene in 3D'),
        h('iframe', { src: artifactUrl(job, 'view.html'), sandbox: 'allow-scripts allow-pointer-lock', title: 'The scene in 3D', class: 'scene', id: 'scene' })),
      sharePanel(run, photoSet, creditForm(), () => workspace?.now ?? 0),
      others.length > 0 && h('section', { 'aria-labelledby': 'versions' }, h('h2', { id: 'versions' }, 'Other versions'),
        h('ul', { class: 'downloads' }, ...others.map((one) => h('li', {}, h('a', { href: `#film/${set}/${one.id}` }, day(one.created_s)))))));
  };

  let asked = false;
  const onRun = async (next: Run, jobs: Job[]): Promise<void> => {
    const before = run?.state;
    run = next;
    showState(next);
    const key = next.pictures.find(({ kind, name }) => kind === 'colorize_key_view' && name === 'key_view_colored.png');
    const isNewEnd = isFinished(next.state) && before !== next.state;
    if (asked && !isNewEnd) {
      if (key) showFirstColors();
      return;
    }
    // The shots are known after the import, the rest at the end.
    const isImported = next.stages.some((stage) => stage.kind === 'import_scene' && stage.state === 'SUCCEEDED') || isFinished(next.state);
    if (!isImported) return;
    asked = true;
    const timeline = await timelineOf(job);
    if (left || !timeline.names.length) return;
    if (isFinished(next.state)) finished = timeline;
    plan = FilmPlan.ofJob(timeline, timeline, changed);
    summary.textContent = factsOf(facts, runsOf(timeline.shots).length);
    const { next: wish } = timeline;
    proposals = wish ? [{
      frame: frameOfName(timeline.names, wish.view),
      text: `the expected colour error falls from ${wish.error_now.toFixed(1)} to ${wish.error_with.toFixed(1)}`,
    }].filter(({ frame }) => frame >= 0) : [];
    build(timeline);
    if (key) showFirstColors();
    if (next.state === 'SUCCEEDED') {
      dropEarly();
      void showResults(jobs);
      main.dataset.state = 'done';
    }
  };

  const load = async (): Promise<void> => {
    try {
      const [described, film, state] = await Promise.all([describeSet(set), describeFilm(set), getState()]);
      if (left) return;
      facts = film;
      found = described.found;
      photoSet = described;
      title.textContent = described.name;
      summary.textContent = factsOf(facts, null);
      const notFrames = async (): Promise<void> => {
        await setAsFrames(set, false);
        selections.delete(set);
        location.hash = `set/${set}`;
      };
      replace(notes, described.as_frames && !job && button('These are photos of a place, not a film', () => void act(notFrames()), { class: 'quiet', id: 'not-frames' }), facts.notes.length > 0 && h('details', { class: 'note' }, h('summary', {}, 'Worth knowing'), h('ul', {}, ...facts.notes.map((note) => h('li', {}, note)))));
      const times = firstTimes(found, facts);
      plan = new FilmPlan(times, { keys: [], parts: [] }, changed);
      build(times);
      options.hidden = job !== '';
      if (job) {
        stops.push(follow(job, {
          run: (next) => void onRun(next, state.jobs).catch((error: Error) => replace(trouble, problem(error.message))),
          problem: (text) => replace(trouble, problem(text, button('Try again', () => dispatchEvent(new HashChangeEvent('hashchange'))))),
          end: () => undefined,
        }));
        return;
      }
      showOptions(state.server.presets);
      await select();
      await showPlan();
    } catch (error) {
      if (left) return;
      share.element.hidden = true;
      if (body.childElementCount) replace(trouble, problem((error as Error).message, button('Try again', () => void load())));
      else replace(body, problem((error as Error).message, h('a', { class: 'button', href: '#' }, 'Drop another film')));
    }
  };
  void load();
  return () => {
    left = true;
    for (const stop of stops) stop();
    workspace?.destroy();
    dropEarly();
    document.title = 'Color3D Studio';
    delete main.dataset.state;
  };
};
