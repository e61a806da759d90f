// What the program works on, what waits, in which order. Shown when there is more than nothing to wait for.
import { cancelJob, type PhotoSet } from '../api';
import { button, h, problem, replace, say } from '../dom';
import { adoptShareStyle } from '../share/style';
import { getQueue, reorder, type Waiting } from './calls';
import { withMoved } from './order';

const lookEveryMs = 4000;

export interface QueueView { element: HTMLElement; refresh: () => void; stop: () => void }

// `sets`: for names; `changed`: the list of scenes is to be read again.
export const queueView = (sets: () => PhotoSet[], changed: () => void): QueueView => {
  adoptShareStyle();
  const element = h('section', { 'aria-labelledby': 'queue-title', hidden: true });
  const list = h('ol', { class: 'queue-list' });
  const trouble = h('div', {});
  replace(element, h('h2', { id: 'queue-title' }, 'At work'), trouble, list);
  let stopped = false, busy = false, shown = '';
  let timer: number | undefined;

  const nameOf = (run: Waiting): string => sets().find((set) => set.scene === run.scene)?.name ?? `Scene ${run.scene.slice(-6)}`;

  const act = async (what: () => Promise<unknown>, told: string): Promise<void> => {
    if (busy) return;
    busy = true;
    for (const control of list.querySelectorAll('button')) control.disabled = true;
    try {
      await what();
      replace(trouble);
      say(told);
    } catch (error) {
      replace(trouble, problem((error as Error).message));
    }
    busy = false;
    shown = '';
    changed();
    await look();
  };

  const draw = (runs: Waiting[]): void => {
    const waiting = runs.filter((run) => !run.has_begun);
    const order = waiting.map(({ id }) => id);
    replace(list, ...runs.map((run) => {
      const place = order.indexOf(run.id);
      const name = nameOf(run);
      const move = (to: number, text: string): HTMLElement => button(text, () =>
        void act(() => reorder(withMoved(order, place, to)), `${name} is moved`), { 'aria-label': `${text}: ${name}` });
      return h('li', { class: 'queue-item', 'data-run': run.id },
        h('a', { class: 'queue-name', href: `#job/${run.id}` }, name),
        h('span', { class: `chip${run.has_begun ? ' state-running' : ''}` }, run.has_begun ? 'being coloured' : place === 0 ? 'next' : `waits, place ${place + 1}`),
        place > 0 && move(0, 'First'),
        place > 0 && move(place - 1, 'Earlier'),
        place >= 0 && place < order.length - 1 && move(place + 1, 'Later'),
        button('Cancel', () => void act(() => cancelJob(run.id), `${name} is cancelled`), { 'aria-label': `Cancel: ${name}` }));
    }));
  };

  const look = async (): Promise<void> => {
    clearTimeout(timer);
    try {
      const runs = await getQueue();
      if (stopped || busy) return;
      const now = JSON.stringify(runs.map((run) => [run.id, run.has_begun, nameOf(run)]));
      if (now !== shown) {
        // Not while a key or finger is on one of its buttons.
        const focused = document.activeElement?.getAttribute('aria-label');
        draw(runs);
        if (focused) list.querySelector<HTMLElement>(`[aria-label=${JSON.stringify(focused)}]`)?.focus();
        if (shown) changed();
        shown = now;
      }
      element.hidden = runs.length === 0;
    } catch {
      // The list of scenes tells when the service is away.
    }
    if (!stopped) timer = window.setTimeout(() => void look(), lookEveryMs);
  };
  void look();
  return {
    element,
    refresh: () => void look(),
    stop: () => {
      stopped = true;
      clearTimeout(timer);
    },
  };
};
