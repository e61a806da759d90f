// The timeline of a film: marks of time, small pictures, shots, coloured frames, and parts in other colours whose
// ends can be dragged. Everything on it is reached by the keyboard, too.
import { h, replace } from '../dom';
import type { FilmPlan } from './film_plan';
import {
  clockOf, frameAt, keyOf, limitsOf, markStep, runsOf, secondsOf, type Edge, type FilmTimes,
} from './timeline_model';

export interface Proposal { readonly frame: number; readonly text: string }
export interface TimelineEvents {
  seek: (frame: number) => void;
  pickKey: (index: number) => void;
  pickPart: (index: number) => void;
  takeProposal: (frame: number) => void;
}
type Picked = { readonly list: 'keys' | 'parts'; readonly index: number } | null;

const farthestZoom = 32;
const pictureWidth = 88; // px, about

export class Timeline {
  readonly root: HTMLElement;
  private readonly scroller = h('div', { class: 'film-scroll' });
  private readonly inner = h('div', { class: 'film-lanes' });
  private readonly ruler = h('div', { class: 'film-ruler', 'aria-hidden': true });
  private readonly strip = h('div', { class: 'film-strip', 'aria-hidden': true });
  private readonly shots = h('div', { class: 'film-lane film-shots', role: 'list', 'aria-label': 'Shots' });
  private readonly keys = h('div', { class: 'film-lane film-keys', role: 'group', 'aria-label': 'Coloured frames' });
  private readonly parts = h('div', { class: 'film-lane film-parts', role: 'group', 'aria-label': 'Parts in other colours' });
  private readonly head = h('div', { class: 'film-head', 'aria-hidden': true });
  private readonly slider: HTMLInputElement;
  private zoom = 1;
  private picturesFor = '';
  private readonly seconds: number;
  private readonly origin: number;
  private readonly watcher: ResizeObserver;

  constructor(private readonly film: FilmTimes, private readonly plan: FilmPlan, private readonly on: TimelineEvents) {
    this.seconds = secondsOf(film.times);
    this.origin = film.times[0] ?? 0;
    this.slider = h('input', {
      type: 'range', class: 'film-moment', id: 'film-moment', min: 0, max: film.times.length - 1, step: 1, value: 0,
      'aria-label': 'Moment', oninput: () => this.on.seek(Number(this.slider.value)),
    });
    const zoomBy = (factor: number): void => this.setZoom(this.zoom * factor);
    replace(this.inner, this.ruler, this.strip, this.shots, this.keys, this.parts, this.head);
    replace(this.scroller, this.inner);
    this.root = h('section', { class: 'film-timeline', 'aria-label': 'Timeline' },
      h('div', { class: 'film-tools' }, this.slider,
        h('button', { type: 'button', id: 'film-wider', title: 'Show more detail', onclick: () => zoomBy(2) }, '+', h('span', { class: 'said' }, 'Show more detail')),
        h('button', { type: 'button', title: 'Show the whole film', onclick: () => zoomBy(0.5) }, '−', h('span', { class: 'said' }, 'Show less detail'))),
      this.scroller);
    for (const lane of [this.ruler, this.strip, this.shots]) lane.addEventListener('pointerdown', (event) => this.scrub(event));
    this.watcher = new ResizeObserver(() => this.layOut());
    this.watcher.observe(this.scroller);
  }

  destroy(): void {
    this.watcher.disconnect();
  }

  // Small pictures come from `address`; `name` tells one series of them from another.
  showPictures(name: string, address: (frame: number) => string): void {
    const count = Math.max(2, Math.min(60, Math.round(this.width / pictureWidth), this.film.times.length));
    if (this.picturesFor === `${name} ${count}`) return;
    this.picturesFor = `${name} ${count}`;
    this.strip.dataset.pictures = name;
    const images = Array.from({ length: count }, (_, i) =>
      h('img', { alt: '', draggable: 'false', 'data-frame': this.frameAtShare((i + 0.5) / count) }));
    replace(this.strip, ...images);
    // One after the other: a film is decoded fastest from front to back.
    const load = (i: number): void => {
      const image = images[i];
      if (!image?.isConnected && i > 0) return;
      image!.onload = image!.onerror = () => { if (i + 1 < count) load(i + 1); };
      image!.src = address(Number(image!.dataset.frame));
    };
    load(0);
  }
  showMoment(frame: number, text: string): void {
    this.slider.value = String(frame);
    this.slider.setAttribute('aria-valuetext', text);
    const left = this.shareOf(this.film.times[frame] ?? 0);
    this.head.style.left = `${100 * left}%`;
    const x = left * this.inner.clientWidth, view = this.scroller;
    if (x < view.scrollLeft || x > view.scrollLeft + view.clientWidth) view.scrollLeft = x - view.clientWidth / 2;
  }

  update(picked: Picked, proposals: readonly Proposal[], now: number): void {
    const focused = (document.activeElement as HTMLElement | null)?.dataset.place;
    this.showShots();
    this.showKeys(picked, proposals, now);
    this.showParts(picked);
    if (focused) this.root.querySelector<HTMLElement>(`[data-place="${focused}"]`)?.focus({ preventScroll: true });
  }

  private get width(): number { return this.inner.clientWidth || 600; }
  private shareOf(time: number): number { return this.seconds > 0 ? (time - this.origin) / this.seconds : 0; }
  private frameAtShare(share: number): number { return frameAt(this.film.times, this.origin + share * this.seconds); }
  private endOf(frame: number): number { return this.film.times[frame + 1] ?? this.origin + this.seconds; }
  private frameAtPoint(x: number): number {
    const box = this.inner.getBoundingClientRect();
    return this.frameAtShare(Math.min(1, Math.max(0, (x - box.left) / box.width)));
  }
  private place(element: HTMLElement, begin: number, end: number): void {
    const left = this.shareOf(this.film.times[begin]!);
    element.style.left = `${100 * left}%`;
    element.style.width = `${100 * (this.shareOf(this.endOf(end)) - left)}%`;
  }

  private setZoom(zoom: number): void {
    this.zoom = Math.min(farthestZoom, Math.max(1, zoom));
    this.inner.style.width = `${100 * this.zoom}%`;
    this.layOut();
    this.showMoment(Number(this.slider.value), this.slider.getAttribute('aria-valuetext') ?? '');
  }

  private layOut(): void {
    const step = markStep(this.seconds, this.width, 64);
    const marks: HTMLElement[] = [];
    for (let time = 0; time < this.seconds; time += step) {
      const mark = h('span', {}, clockOf(time, step < 0.1));
      mark.style.left = `${100 * time / this.seconds}%`;
      marks.push(mark);
    }
    replace(this.ruler, ...marks);
    this.root.dispatchEvent(new CustomEvent('laid-out'));
  }

  private drag(event: PointerEvent, move: (frame: number) => void): void {
    if (event.button !== 0) return;
    const target = event.currentTarget as HTMLElement;
    target.setPointerCapture(event.pointerId);
    const onMove = (next: PointerEvent): void => move(this.frameAtPoint(next.clientX));
    const end = (): void => {
      target.removeEventListener('pointermove', onMove);
      for (const kind of ['pointerup', 'pointercancel'] as const) target.removeEventListener(kind, end);
    };
    target.addEventListener('pointermove', onMove);
    for (const kind of ['pointerup', 'pointercancel'] as const) target.addEventListener(kind, end);
  }
  private scrub(event: PointerEvent): void {
    if (event.button !== 0) return;
    this.on.seek(this.frameAtPoint(event.clientX));
    this.drag(event, (frame) => this.on.seek(frame));
  }

  private showShots(): void {
    const runs = runsOf(this.film.shots);
    const numbers = new Map([...new Set(this.film.shots)].map((shot, i) => [shot, i + 1]));
    replace(this.shots, ...runs.map((run) => {
      const text = runs.length === 1 ? 'One shot' : `Shot ${numbers.get(run.shot)}`;
      const shot = h('span', { role: 'listitem', title: `${text}, ${run.end - run.begin + 1} frames`, 'aria-label': `${text}, ${clockOf(this.film.times[run.begin]!)} to ${clockOf(this.endOf(run.end))}` }, text);
      this.place(shot, run.begin, run.end);
      return shot;
    }));
  }

  private showKeys(picked: Picked, proposals: readonly Proposal[], now: number): void {
    const frames = this.plan.keys.map((key) => key.frame);
    const used = keyOf(now, frames, this.film);
    const button = (frame: number, text: string, properties: Record<string, string | boolean | (() => void)>): HTMLElement => {
      const mark = h('button', { type: 'button', title: text, ...properties } as never, h('span', { class: 'said' }, text));
      mark.style.left = `${100 * this.shareOf(this.film.times[frame]!)}%`;
      return mark;
    };
    replace(this.keys,
      ...frames.map((frame, i) => button(frame, `Coloured frame at ${clockOf(this.film.times[frame]!)}`, {
        class: `film-key${i === used ? ' used' : ''}`, 'data-place': `key${i}`,
        'aria-pressed': String(picked?.list === 'keys' && picked.index === i), onclick: () => this.on.pickKey(i),
      })),
      ...proposals.filter(({ frame }) => !frames.includes(frame)).map(({ frame, text }) => button(frame, text, {
        class: 'film-key proposed', 'data-place': `proposal${frame}`, onclick: () => this.on.takeProposal(frame),
      })));
  }

  private showParts(picked: Picked): void {
    this.parts.hidden = this.plan.parts.length === 0;
    replace(this.parts, ...this.plan.parts.map((part, i) => {
      const times = `${clockOf(this.film.times[part.begin]!)} to ${clockOf(this.endOf(part.end))}`;
      const isPicked = picked?.list === 'parts' && picked.index === i;
      const bar = h('div', { class: `film-part${isPicked ? ' picked' : ''}`, 'data-part': i },
        this.handle(i, 'begin'),
        h('button', { type: 'button', class: 'film-part-body', 'data-place': `part${i}`, 'aria-pressed': String(isPicked), title: `Other colours, ${times}`, onclick: () => this.on.pickPart(i) },
          h('span', { class: 'film-part-name' }, 'Other colours'), h('span', { class: 'said' }, `, ${times}`)),
        this.handle(i, 'end'));
      this.place(bar, part.begin, part.end);
      return bar;
    }));
  }

  private handle(index: number, edge: Edge): HTMLElement {
    const part = this.plan.parts[index]!;
    const limits = limitsOf(part, this.plan.parts, this.film);
    const [low, high] = edge === 'begin' ? [limits.begin, part.frame] : [part.frame, limits.end];
    const value = part[edge];
    const time = edge === 'begin' ? this.film.times[value]! : this.endOf(value);
    const handle = h('span', {
      class: `film-edge ${edge}`, role: 'slider', tabindex: 0, 'data-place': `${edge}${index}`,
      'aria-label': edge === 'begin' ? 'From' : 'To', 'aria-valuemin': low, 'aria-valuemax': high, 'aria-valuenow': value,
      'aria-valuetext': clockOf(time), title: `${edge === 'begin' ? 'From' : 'To'} ${clockOf(time)}`,
    });
    // One drag is one step of undo. The handle is made anew after each change, so the drag goes on at the lane.
    handle.addEventListener('pointerdown', (event) => {
      if (event.button !== 0) return;
      event.preventDefault();
      handle.focus({ preventScroll: true });
      let joins = false;
      const move = (next: PointerEvent): void => {
        joins = this.plan.moveEdge(index, edge, this.frameAtPoint(next.clientX), joins) || joins;
        this.on.seek(this.plan.parts[index]![edge]);
      };
      this.parts.setPointerCapture(event.pointerId);
      const end = (): void => {
        this.parts.removeEventListener('pointermove', move);
        for (const kind of ['pointerup', 'pointercancel'] as const) this.parts.removeEventListener(kind, end);
      };
      this.parts.addEventListener('pointermove', move);
      for (const kind of ['pointerup', 'pointercancel'] as const) this.parts.addEventListener(kind, end);
    });
    handle.addEventListener('keydown', (event) => {
      const by: Record<string, number> = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -10, PageUp: 10 };
      const to = event.key === 'Home' ? low : event.key === 'End' ? high : by[event.key] === undefined ? -1 : value + by[event.key]!;
      if (event.key !== 'Home' && event.key !== 'End' && by[event.key] === undefined) return;
      event.preventDefault();
      event.stopPropagation();
      this.plan.moveEdge(index, edge, to, false);
      this.on.seek(this.plan.parts[index]![edge]);
    });
    return handle;
  }
}
