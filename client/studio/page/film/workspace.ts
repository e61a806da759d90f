// The film with its timeline: what is shown, what is picked, and the painter in place of the film.
import { previewColors } from '../api';
import { button, h, replace, say } from '../dom';
import { Painter, serializeStrokes, type StrokeFile } from '../paint/index';
import { ColoringPanel, type List } from './coloring_panel';
import { frameUrl, type FilmFacts } from './film_api';
import type { FilmPlan } from './film_plan';
import { playerBar, Screen, type FilmSource } from './screen';
import { Timeline, type Proposal } from './timeline';
import { clockOf, secondsOf } from './timeline_model';

const panelPictureSide = 160; // px

export interface WorkspaceOptions {
  readonly set: string;
  readonly facts: FilmFacts;
  readonly plan: () => FilmPlan;
  readonly proposals: readonly Proposal[];
  readonly source: FilmSource;
  readonly allowsParts: boolean;
  readonly whyNoParts: string;
  readonly pictures: () => { name: string; address: (frame: number) => string }; // of the timeline
  readonly onPause: (frame: number) => void; // stands still at this frame
  readonly side: readonly (Node | null)[]; // below the panel
}

export class Workspace {
  readonly root = h('div', { class: 'film-layout' });
  readonly screen: Screen;
  readonly timeline: Timeline;
  private readonly panel: ColoringPanel;
  private readonly bar: ReturnType<typeof playerBar>;
  private readonly stage = h('div', { class: 'film-stage' });
  private readonly player: HTMLElement;
  private readonly trouble = h('p', { class: 'soft small', role: 'status' });
  private picked: { list: List; index: number } | null = null;
  private painter: Painter | undefined;
  private isColored: boolean;
  private resting: ReturnType<typeof setTimeout> | undefined;
  private ended = false;
  private readonly onKey = (event: KeyboardEvent): void => this.key(event);

  constructor(private readonly options: WorkspaceOptions) {
    const { facts } = options;
    const plan = options.plan();
    this.isColored = options.source.isColored;
    this.screen = new Screen(plan.film.times, facts.width || 16, facts.height || 9, {
      frame: (frame) => this.moved(frame),
      playing: () => this.showBar(),
      trouble: (text) => { this.trouble.textContent = text; },
    });
    this.bar = playerBar({
      step: (frames) => this.step(frames),
      toggle: () => this.screen.play(!this.screen.isPlaying),
      speed: (value) => this.screen.setSpeed(value),
      loop: (on) => this.screen.setLoop(on),
      compare: (on) => this.screen.setCompare(on),
      sound: (on) => this.screen.setSound(on),
    }, facts.has_sound);
    this.timeline = new Timeline(plan.film, plan, {
      seek: (frame) => this.seek(frame),
      pickKey: (index) => this.pick('keys', index),
      pickPart: (index) => this.pick('parts', index),
      takeProposal: (frame) => this.take(frame),
    });
    this.panel = new ColoringPanel(plan, {
      seek: (frame) => this.seek(frame),
      pick: (list, index) => this.pick(list, index),
      paint: (list, index) => void this.paint(list, index),
      add: (list) => this.add(list),
      takeProposal: (frame) => this.take(frame),
    });
    this.timeline.root.addEventListener('laid-out', () => this.showPictures());
    this.player = h('div', {}, h('div', { class: 'film-wrap' }, this.screen.root), this.bar.root, this.timeline.root, this.trouble);
    replace(this.stage, this.player);
    replace(this.root, this.stage, h('div', { class: 'film-side' }, this.panel.root, ...options.side));
    this.screen.show(options.source);
    this.update();
    this.moved(0);
    addEventListener('keydown', this.onKey);
  }

  showPictures(): void {
    const { name, address } = this.options.pictures();
    this.timeline.showPictures(name, address);
  }
  get now(): number { return this.screen.now; }

  update(): void {
    const state = { picked: this.picked, proposals: this.options.proposals };
    const { source } = this.options;
    const { list, index } = this.picked ?? { list: 'keys' as const, index: -1 };
    if (this.picked && !this.options.plan()[list][index]) this.picked = null;
    this.timeline.update(this.picked, state.proposals, this.now);
    this.panel.update({
      set: this.options.set, now: this.now, picked: this.picked, proposals: state.proposals,
      allowsParts: this.options.allowsParts, whyNoParts: this.options.whyNoParts,
      colored: source.isColored ? (frame) => source.frame(frame, panelPictureSide) : null,
    });
  }

  seek(frame: number): void {
    if (this.screen.isPlaying) this.screen.play(false);
    this.screen.seek(frame);
  }

  destroy(): void {
    this.ended = true;
    removeEventListener('keydown', this.onKey);
    clearTimeout(this.resting);
    this.endPainter();
    this.screen.destroy();
    this.timeline.destroy();
  }

  private moved(frame: number): void {
    const { times } = this.options.plan().film;
    const text = `${clockOf(times[frame]! - times[0]!)} / ${clockOf(secondsOf(times))}`;
    this.timeline.showMoment(frame, text.replace('/', 'of'));
    this.showBar();
    clearTimeout(this.resting);
    this.resting = setTimeout(() => {
      if (this.ended || this.screen.isPlaying) return;
      this.update();
      this.options.onPause(this.now);
    }, 150);
  }
  private showBar(): void {
    const { times } = this.options.plan().film;
    this.bar.show({
      playing: this.screen.isPlaying, canCompare: this.isColored,
      clock: `${clockOf(times[this.now]! - times[0]!)} / ${clockOf(secondsOf(times))}`,
    });
  }
  private step(frames: number): void {
    this.seek(this.now + frames);
  }

  private pick(list: List, index: number): void {
    const one = this.options.plan()[list][index];
    const isAgain = this.picked?.list === list && this.picked.index === index;
    this.picked = isAgain || !one ? null : { list, index };
    if (one && !isAgain) this.seek(one.frame);
    this.update();
  }
  private add(list: List): void {
    const plan = this.options.plan();
    const index = list === 'keys' ? plan.addKey(this.now) : plan.addPart(this.now);
    this.picked = { list, index };
    this.update();
    say(list === 'keys' ? 'This frame will be coloured' : 'Choose other colours for this part');
  }
  private take(frame: number): void {
    const index = this.options.plan().addKey(frame);
    this.picked = { list: 'keys', index };
    this.seek(frame);
    this.update();
  }

  private endPainter(): void {
    this.painter?.destroy();
    this.painter = undefined;
  }

  private async paint(list: List, index: number): Promise<void> {
    const { set } = this.options;
    const plan = this.options.plan();
    const one = plan[list][index];
    if (!one) return;
    this.seek(one.frame);
    const name = plan.film.names[one.frame]!;
    const response = await fetch(frameUrl(set, name, 0, true));
    if (this.ended || !response.ok) return;
    const photo = await createImageBitmap(await response.blob());
    this.endPainter();
    const host = h('div', { class: 'film-painter', id: 'film-painter' });
    let joins = false;
    const done = button('Done', () => {
      this.endPainter();
      replace(this.stage, this.player);
      this.root.parentElement?.classList.remove('film-painting');
      this.update();
      document.getElementById(`${list}-${index}`)?.focus();
    }, { class: 'main-button', id: 'paint-done' });
    replace(this.stage, h('p', { class: 'row' }, done, h('span', { class: 'soft' }, `The frame at ${clockOf(plan.film.times[one.frame]!)}`)), host);
    this.root.parentElement?.classList.add('film-painting');
    this.painter = new Painter(host, {
      photo,
      preview: async (strokes, side, signal) => createImageBitmap(
        await previewColors(set, name, { color: 'automatic', strokes: serializeStrokes(strokes) }, side, signal)),
      onChange: (strokes) => {
        plan.color(list, index, { way: 'strokes', strokes }, joins);
        joins = true;
      },
    });
    if (one.strokes?.length) this.painter.load(one.strokes as StrokeFile);
    this.painter.focus();
  }

  // Space plays, comma and full stop go one frame, wherever the focus is not on a control that uses the key.
  private key(event: KeyboardEvent): void {
    const target = event.target as HTMLElement;
    if (this.painter || event.altKey) return;
    if (event.ctrlKey || event.metaKey) {
      if (event.key.toLowerCase() !== 'z') return;
      if (event.shiftKey) this.options.plan().redo();
      else this.options.plan().undo();
      event.preventDefault();
      return;
    }
    const uses = target.closest('button, select, input:not([type=range]), a, summary, textarea, iframe');
    if (event.key === ' ' && !uses) this.screen.play(!this.screen.isPlaying);
    else if (event.key === ',' && !target.closest('input:not([type=range])')) this.step(-1);
    else if (event.key === '.' && !target.closest('input:not([type=range])')) this.step(1);
    else return;
    event.preventDefault();
  }
}
