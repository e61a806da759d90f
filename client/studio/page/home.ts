// The first page: drop photos, or go on with what is there.
import { getState, makeSet, photoUrl, sendFile, describeSet, type Job, type PhotoSet } from './api';
import { bar, button, h, problem, replace, say } from './dom';
import { filesOfDrop, filesOfInput, type Drop } from './drops';
import { frameUrl } from './film/film_api';
import { queueView } from './queue/queue';
import { bytes, day, isFinished, stateName } from './words';

const filesAtOnce = 3;
const maxFiles = 10000;

// Sends the files; `progress` gets the share of the bytes.
const sendAll = async (set: string, drop: Drop, progress: (share: number) => void): Promise<void> => {
  const total = drop.files.reduce((sum, { file }) => sum + file.size, 0) || 1;
  const waiting = [...drop.files];
  let sent = 0;
  const send = async (): Promise<void> => {
    for (let next = waiting.shift(); next; next = waiting.shift()) {
      await sendFile(set, next.path, next.file);
      sent += next.file.size;
      progress(sent / total);
    }
  };
  await Promise.all(Array.from({ length: filesAtOnce }, send));
};

const thumbnails = (drop: Drop): HTMLElement => {
  const pictures = drop.files.filter(({ file }) => /^image\/(jpeg|png|webp|bmp)$/.test(file.type)).slice(0, 24);
  const list = h('ul', { class: 'thumbs', 'aria-hidden': true });
  for (const { file } of pictures) {
    const url = URL.createObjectURL(file);
    list.append(h('li', {}, h('img', { src: url, alt: '', onload: () => URL.revokeObjectURL(url) })));
  }
  return list;
};

const card = (set: PhotoSet | undefined, job: Job | undefined): HTMLElement => {
  const name = set?.name ?? `Scene ${job!.scene.slice(-6)}`;
  const target = job ? `#job/${job.id}` : `#set/${set!.id}`;
  // A run is BLOCKED, as the service calls it, while its stages work.
  const goesOn = job && !isFinished(job.state);
  const state = !job ? 'not coloured yet' : !goesOn ? (job.state === 'SUCCEEDED' ? 'coloured' : stateName(job.state))
    : job.queue_position > 0 ? `place ${job.queue_position} in the queue` : 'being coloured';
  const picture = h('div', { class: 'card-picture', 'aria-hidden': true });
  if (set) {
    void describeSet(set.id).then(({ found }) => {
      const first = found.photos.find((photo) => photo.name === job?.key_view) ?? found.photos[0];
      if (!first && found.kind === 'film') picture.append(h('img', { src: frameUrl(set.id, 'f000000', 320, false), alt: '', loading: 'lazy' }));
      if (first) picture.append(h('img', { src: photoUrl(set.id, first.name, 320), alt: '', loading: 'lazy' }));
    }).catch(() => undefined);
  }
  return h('li', {}, h('a', { class: 'card', href: target }, picture,
    h('span', { class: 'card-name' }, name),
    h('span', { class: `chip state-${goesOn ? 'running' : (job?.state ?? 'NONE').toLowerCase()}` }, state),
    h('span', { class: 'soft' }, day(job?.created_s ?? set!.created_s))));
};

// One card for each set without a run, and for each run.
const cards = (sets: PhotoSet[], jobs: Job[]): HTMLElement[] => {
  const colored = new Set(jobs.map((job) => job.scene));
  const rows = [
    ...jobs.map((job) => ({ at: job.created_s, element: card(sets.find((set) => set.scene === job.scene), job) })),
    ...sets.filter((set) => !set.scene || !colored.has(set.scene)).map((set) => ({ at: set.created_s, element: card(set, undefined) })),
  ];
  return rows.sort((a, b) => b.at - a.at).map(({ element }) => element);
};

export const showHome = (main: HTMLElement): (() => void) => {
  const dropping = h('div', { class: 'dropping' });
  const take = async (drop: Drop): Promise<void> => {
    if (!drop.files.length) return;
    if (drop.files.length > maxFiles) {
      replace(dropping, problem(`${drop.files.length} files are too many; up to ${maxFiles} make a scene. Drop fewer.`));
      return;
    }
    const { element, set: show } = bar('Copying the files');
    const size = bytes(drop.files.reduce((sum, { file }) => sum + file.size, 0));
    show(0);
    replace(dropping, h('p', {}, `${drop.name}: ${drop.files.length} files, ${size}`), element, thumbnails(drop));
    say(`Copying ${drop.files.length} files`);
    area.hidden = true;
    try {
      const set = await makeSet(drop.name);
      await sendAll(set.id, drop, show);
      location.hash = `set/${set.id}`;
    } catch (error) {
      area.hidden = false;
      replace(dropping, problem((error as Error).message));
    }
  };
  const input = (label: string, id: string, folder: boolean): HTMLElement => {
    const field = h('input', {
      type: 'file', id, multiple: true, class: 'said', ...(folder ? { webkitdirectory: true } : {}),
      onchange: (event) => void take(filesOfInput(event.currentTarget as HTMLInputElement)),
    });
    return h('span', { class: 'file-choice' }, field, h('label', { for: id, class: folder ? 'button' : 'button main-button' }, label));
  };
  const area = h('div', {
    class: 'drop-area',
    ondragenter: () => area.classList.add('over'),
    ondragover: (event) => event.preventDefault(),
    ondragleave: (event) => { if (event.target === area) area.classList.remove('over'); },
    ondrop: (event) => {
      event.preventDefault();
      area.classList.remove('over');
      void filesOfDrop((event as DragEvent).dataTransfer!).then(take);
    },
  },
  h('p', { class: 'drop-title' }, 'Drop photos or a film here'),
  h('p', { class: 'soft' }, 'Ten to fifty photos of one place where nothing moves, from different positions. Or one film.'),
  h('p', { class: 'row' }, input('Choose photos', 'choose-files', false), input('Choose a folder', 'choose-folder', true)));

  const list = h('section', { 'aria-labelledby': 'list-title', hidden: true });
  let known: PhotoSet[] = [];
  const queue = queueView(() => known, () => void load());
  replace(main,
    h('div', { class: 'hero' },
      h('h1', {}, 'Colour a place from its grey photos'),
      h('p', { class: 'lead' }, 'You colour one photo. Its colours go to the same surfaces in all others, and to a 3D scene that you can walk through.')),
    area, dropping, queue.element, list,
    h('p', { class: 'soft small' }, 'Everything stays on this computer.'));

  const load = async (): Promise<void> => {
    try {
      const { sets, jobs } = await getState();
      known = sets;
      queue.refresh();
      const rows = cards(sets, jobs);
      list.hidden = rows.length === 0;
      replace(list, h('h2', { id: 'list-title' }, 'Your scenes'), h('ul', { class: 'cards' }, ...rows));
    } catch (error) {
      list.hidden = false;
      replace(list, problem((error as Error).message, button('Try again', () => void load())));
    }
  };
  void load();
  return queue.stop;
};
