// Where the colours of the key photo come from: the choice beside it. Strokes lie above them.
import { colorBelow, follow, keepPicture, photoUrl, type Colors, type Run, type Source } from './api';
import { bar, button, h, replace, say } from './dom';
import { seconds } from './words';

export interface ColorSourcesOptions {
  readonly set: string;
  readonly knowsWords: boolean; // the service has a model for them
  view(): string;
  size(): { width: number; height: number } | undefined; // of the photo, px
  change(): void; // other colours
  problem(text: string | null): void;
}
export interface ColorSources {
  readonly root: HTMLElement;
  // What a run colours the photo with, without strokes; throws what is missing, in words.
  now(): Colors;
  // The same for a preview; undefined until there is something to see.
  seen(): Colors | undefined;
  // A picture that was dropped: the photo in colour if it has its size, else a reference.
  take(file: File): Promise<void>;
  // Another photo was chosen.
  forget(): void;
  // The colours that now() gave for the photo that is shown again.
  restore(colors: Colors): void;
  stop(): void;
}

const ways: readonly (readonly [Source, string, string])[] = [
  ['automatic', 'Automatic', 'The program guesses sky, plants, skin and wood. It cannot know the colour of a coat: paint it.'],
  ['picture', 'A picture I coloured', 'Save the photo, colour it in a paint program, and bring it back in the same size.'],
  ['reference', 'Colours of another picture', 'Bring a coloured picture of something similar. Each part takes the colours of what resembles it.'],
  ['words', 'Words', 'Name things with their colours, such as “red brick, green lawn, pale blue sky”.'],
  ['nothing', 'Only what I paint', 'Your strokes alone: each spreads over the photo up to the edges.'],
];
const stemOf = (view: string): string => view.replace(/^.*\//, '').replace(/\.[^.]*$/, '');

export const colorSources = (options: ColorSourcesOptions): ColorSources => {
  let source: Source = 'automatic';
  let picture: { name: string; kept: string; size: string } | undefined;
  let words = '', madeBy = '', stopFollowing: (() => void) | undefined;
  const detail = h('div', { class: 'way-detail' });

  const withdraw = (): void => {
    stopFollowing?.();
    stopFollowing = undefined;
    madeBy = '';
  };
  const colors = (): Colors => ({
    color: source,
    ...(source === 'picture' || source === 'reference' ? { picture: picture?.kept ?? '' } : {}),
    ...(source === 'words' ? { words } : {}),
  });
  const now = (): Colors => {
    if (source === 'picture' && !picture) throw new Error('Bring the coloured picture first.');
    if (source === 'reference' && !picture) throw new Error('Bring the other picture first.');
    if (source === 'words' && !words.trim()) throw new Error('Name things with their colours first.');
    return colors();
  };

  // Colours by a reference or words take a while: a job, with its bar.
  const make = async (): Promise<void> => {
    withdraw();
    const waiting = bar('Colouring the photo');
    const doing = h('p', { class: 'soft', role: 'status' }, 'Colouring the photo …');
    const place = detail.querySelector('.way-work')!;
    replace(place, doing, waiting.element);
    const fail = (text: string): void => {
      replace(place);
      options.problem(text);
    };
    try {
      options.problem(null);
      const job = await colorBelow(options.set, options.view(), now());
      let last: Run | undefined;
      stopFollowing = follow(job.id, {
        run: (run) => {
          last = run;
          const stage = run.stages.find(({ state }) => state === 'RUNNING');
          doing.textContent = `Colouring the photo …${stage && stage.seconds_left > 1 ? ` about ${seconds(stage.seconds_left)} left` : ''}`;
          waiting.set(stage && stage.share > 0 ? stage.share : null);
        },
        problem: fail,
        end: () => {
          if (last?.state !== 'SUCCEEDED') return fail(last?.stages.find(({ error }) => error)?.error ?? last?.error ?? 'The photo was not coloured.');
          madeBy = job.id;
          replace(place);
          say('The photo is coloured');
          options.change();
        },
      });
    } catch (error) {
      fail((error as Error).message);
    }
  };

  const bring = async (file: File, as: Source): Promise<void> => {
    try {
      const { picture: kept, width, height } = await keepPicture(options.set, file);
      const photo = options.size();
      if (as === 'picture' && photo && (photo.width !== width || photo.height !== height)) {
        throw new Error(`${file.name} has ${width} × ${height} px, the photo ${photo.width} × ${photo.height}. `
          + 'Save the photo, colour that, and bring it back in its size; or take it as “Colours of another picture”.');
      }
      picture = { name: file.name, kept, size: `${width} × ${height}` };
      options.problem(null);
      withdraw();
      show(as);
      if (as === 'reference') await make();
      else options.change();
    } catch (error) {
      options.problem((error as Error).message);
    }
  };
  const fileChoice = (id: string, label: string, as: Source): HTMLElement => {
    const input = h('input', { type: 'file', accept: 'image/*', id, class: 'said', onchange: () => {
      const file = input.files?.[0];
      input.value = '';
      if (file) void bring(file, as);
    } });
    return h('span', { class: 'file-choice' }, input, h('label', { for: id, class: 'button' }, label));
  };

  const show = (next: Source): void => {
    source = next;
    for (const input of choice.querySelectorAll('input')) input.checked = input.value === next;
    const brought = h('p', { id: 'brought', class: 'soft', role: 'status' }, picture ? `${picture.name}, ${picture.size}` : '');
    const text = h('p', { class: 'soft' }, ways.find(([value]) => value === next)![2]);
    const work = h('div', { class: 'way-work' });
    if (next === 'picture') {
      const view = options.view();
      replace(detail, text, h('p', { class: 'row' },
        h('a', { class: 'button', href: photoUrl(options.set, view), download: `${stemOf(view)}.jpg` }, 'Save the photo'),
        fileChoice('colored-picture', 'Bring the coloured picture', next)), brought, work);
    } else if (next === 'reference') {
      replace(detail, text, h('p', { class: 'row' }, fileChoice('reference-picture', 'Bring the other picture', next)), brought, work);
    } else if (next === 'words') {
      const field = h('textarea', { id: 'color-words', rows: 3, maxlength: 900, oninput: () => { words = field.value; withdraw(); } });
      field.value = words;
      replace(detail, h('label', { for: 'color-words', class: 'soft' }, ways.find(([value]) => value === next)![2]), field,
        h('p', {}, button('Colour by these words', () => void make())), work);
    } else {
      replace(detail, text, work);
    }
  };
  const pick = (next: Source): void => {
    if (next === source) return;
    withdraw();
    picture = undefined;
    options.problem(null);
    show(next);
    options.change();
  };
  const choice = h('fieldset', { class: 'choices' }, h('legend', {}, 'Its colours'),
    ...ways.filter(([value]) => value !== 'words' || options.knowsWords).map(([value, label]) => h('label', {},
      h('input', { type: 'radio', name: 'way', value, checked: value === source, onchange: () => pick(value) }), ` ${label}`)));
  show(source);

  return {
    root: h('div', {}, choice, detail),
    now,
    seen: () => {
      if (source === 'nothing' || (source === 'picture' && !picture)) return undefined;
      if ((source === 'reference' || source === 'words') && !madeBy) return undefined;
      return { ...colors(), ...(madeBy ? { made_by: madeBy } : {}) };
    },
    take: async (file) => {
      const size = await createImageBitmap(file).then(({ width, height }) => ({ width, height }), () => undefined);
      const photo = options.size();
      const isPhoto = !size || !photo || (size.width === photo.width && size.height === photo.height);
      await bring(file, isPhoto ? 'picture' : 'reference');
    },
    forget: () => {
      withdraw();
      if (source === 'picture') picture = undefined;
      show(source);
      if (source === 'reference' && picture) void make();
    },
    restore: (kept) => {
      picture = kept.picture ? { name: 'Your picture', kept: kept.picture, size: 'as before' } : undefined;
      words = kept.words ?? words;
      show(kept.color);
      if (kept.color === 'reference' || kept.color === 'words') void make();
      else options.change();
    },
    stop: withdraw,
  };
};
