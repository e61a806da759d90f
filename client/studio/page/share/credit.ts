// Who coloured, the original and the licence: typed once, kept by the studio, written into every picture.
import { h, problem, replace } from '../dom';
import { getCredit, keepCredit, type Credit } from './calls';
import { creditText } from './texts';

type Field = 'colored_by' | 'key_view_by' | 'source' | 'licence';
const fields: [Field, string, string][] = [
  ['colored_by', 'Coloured by', 'Your name or institution'],
  ['key_view_by', 'Key photo coloured by', 'If somebody else painted it'],
  ['source', 'Original', 'Archive and number'],
  ['licence', 'Licence', 'CC BY 4.0'],
];
const licences = ['CC BY 4.0', 'CC BY-SA 4.0', 'CC BY-NC 4.0', 'CC0 1.0', 'Public domain', 'All rights reserved'];
const pauseMs = 400;

export interface CreditForm {
  element: HTMLElement;
  wantsCaption: () => boolean;
  kept: () => Promise<void>;
  changed: () => void; // set by the user of the form; called after each change of the text or the caption
}

// One for each page: what was typed stays when the panels around it are made again.
export const creditForm = (): CreditForm => {
  const credit: Credit = { colored_by: '', key_view_by: '', source: '', licence: '' };
  const shown = h('p', { class: 'share-credit', role: 'status' });
  const trouble = h('div', {});
  let waiting: number | undefined;
  let saving: Promise<void> = Promise.resolve();
  const save = (): void => {
    waiting = undefined;
    saving = keepCredit(credit).then(() => replace(trouble), (error: Error) => replace(trouble, problem(error.message)));
  };
  const show = (): void => { shown.textContent = creditText(credit); };
  const inputs = fields.map(([name, label, example]) => {
    const input = h('input', {
      type: 'text', id: `credit-${name}`, maxlength: 240, placeholder: example, ...(name === 'licence' ? { list: 'licences' } : {}),
      oninput: () => {
        credit[name] = input.value.trim();
        show();
        clearTimeout(waiting);
        waiting = window.setTimeout(save, pauseMs);
        form.changed();
      },
    });
    return { name, input, row: h('p', {}, h('label', { for: input.id }, label), input) };
  });
  const caption = h('input', { type: 'checkbox', id: 'caption', onchange: () => form.changed() });
  const element = h('fieldset', { class: 'share-form' },
    h('legend', {}, 'Who made the colours'),
    h('p', { class: 'soft small' }, 'Written into every picture that you save here, where archives and picture programs look for it.'),
    h('div', { class: 'share-fields' }, ...inputs.map(({ row }) => row)),
    h('datalist', { id: 'licences' }, ...licences.map((value) => h('option', { value }))),
    shown, h('label', { class: 'share-check' }, caption, ' Also as a caption below each picture'), trouble);
  const form: CreditForm = {
    element,
    wantsCaption: () => caption.checked,
    kept: async () => {
      if (waiting !== undefined) {
        clearTimeout(waiting);
        save();
      }
      await saving;
    },
    changed: () => undefined,
  };
  show();
  void getCredit().then((known) => {
    for (const { name, input } of inputs) {
      if (input.value) continue; // typed meanwhile
      credit[name] = known[name] ?? '';
      input.value = credit[name];
    }
    show();
    form.changed();
  }).catch((error: Error) => replace(trouble, problem(error.message)));
  return form;
};
