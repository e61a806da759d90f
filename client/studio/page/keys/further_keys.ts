// More photos that are coloured for the same run, each for what those before it do not show.
import { photoUrl } from '../api';
import { button, h, replace, say } from '../dom';
import { nextView, withKey, withoutKey } from './key_list';

const mostKeys = 17; // of the service

export interface FurtherKeysOptions<Key extends { key_view: string }> {
  readonly set: string;
  readonly proposed: readonly string[]; // photos in the order in which they help
  readonly photos: readonly string[];
  key(): Key; // the photo that is shown, with its colours; throws what is missing, in words
  go(view: string, kept: Key | undefined): void; // shows another photo, with the colours that were kept for it
  problem(text: string | null): void;
}
export interface FurtherKeys<Key> {
  readonly root: HTMLElement;
  all(): Key[]; // with the photo that is shown; throws as key()
}

export const furtherKeys = <Key extends { key_view: string }>(options: FurtherKeysOptions<Key>): FurtherKeys<Key> => {
  let keys: Key[] = [];
  const list = h('ul', { class: 'further-keys' });
  const more = button('Colour another photo as well', () => {
    try {
      const kept = withKey(keys, options.key());
      const next = nextView(kept, options.proposed) ?? nextView(kept, options.photos);
      if (next === undefined || kept.length >= mostKeys) throw new Error('There is no other photo to colour.');
      keys = kept;
      options.problem(null);
      draw();
      options.go(next, undefined);
      say(`${kept.length} photos are coloured; now ${next}`);
    } catch (error) {
      options.problem((error as Error).message);
    }
  }, { id: 'another-key' });
  const draw = (): void => replace(list, ...keys.map((key) => h('li', { class: 'row' },
    h('img', { src: photoUrl(options.set, key.key_view, 120), alt: '' }),
    h('span', { class: 'name' }, key.key_view),
    button('Change', () => options.go(key.key_view, key), { 'aria-label': `Change the colours of ${key.key_view}` }),
    button('Remove', () => {
      keys = withoutKey(keys, key.key_view);
      draw();
      more.focus();
    }, { 'aria-label': `Remove ${key.key_view}` }))));
  return {
    root: h('section', { 'aria-label': 'More coloured photos' }, list,
      h('p', {}, more), h('p', { class: 'soft small' }, 'Its colours are used where the first one shows nothing.')),
    all: () => withKey(keys, options.key()),
  };
};
