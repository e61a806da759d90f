// The picture of a film: plays it, or shows one frame. A movie where the browser can play it; else its frames, one
// after the other as they arrive. Compares grey and colour by a line that can be dragged.
import { h, replace } from '../dom';
import { clockOf, frameAt, insideOf, secondsOf } from './timeline_model';

export interface FilmSource {
  readonly video: string | null; // address of a movie with these frames
  readonly frame: (frame: number, side: number) => string; // address of one as JPEG
  readonly isColored: boolean;
  readonly isGray: boolean; // its pictures have no colour of their own
}
export interface ScreenEvents {
  frame: (frame: number) => void;
  playing: (on: boolean) => void;
  trouble: (text: string) => void;
}

const largestSide = 1600; // px, of frames

export class Screen {
  readonly root: HTMLElement;
  private readonly video = h('video', { class: 'film-video', playsinline: true, preload: 'auto', hidden: true });
  private readonly canvas = h('canvas', { class: 'film-frame', role: 'img', 'aria-label': 'The film' });
  private readonly early = h('img', { class: 'film-early', alt: 'This frame, a first guess', hidden: true });
  private readonly gray = h('div', { class: 'film-gray', hidden: true, 'aria-hidden': true });
  private readonly line = h('div', { class: 'film-line', hidden: true, 'aria-hidden': true });
  private readonly divider: HTMLInputElement;
  private readonly dividerLabel: HTMLElement;
  private source: FilmSource | undefined;
  private playsMovie = false;
  private frame = 0;
  private playing = false;
  private speed = 1;
  private loops = true;
  private compares = false;
  private position = 0; // seconds, of frames that play one by one
  private last = 0;
  private wanted = -1;
  private wantedTime: number | null = null; // of the movie, once its present seek has ended
  private loading = false;
  private ticking = 0;
  private ended = false;

  constructor(private readonly times: readonly number[], width: number, height: number, private readonly on: ScreenEvents) {
    this.divider = h('input', {
      type: 'range', min: 0, max: 100, value: 50, class: 'film-divider', 'aria-label': 'Grey against colour', hidden: true,
      oninput: () => this.layOut(),
    });
    this.dividerLabel = h('p', { class: 'film-sides', hidden: true, 'aria-hidden': true }, h('span', {}, 'Grey'), h('span', {}, 'Coloured'));
    this.root = h('div', { class: 'film-screen' }, this.video, this.canvas, this.early, this.gray, this.line, this.dividerLabel, this.divider);
    this.root.style.aspectRatio = `${width} / ${height}`;
    this.root.style.setProperty('--shape', String(width / height));
    this.canvas.width = width;
    this.canvas.height = height;
    this.video.addEventListener('error', () => this.playFrames());
    this.video.addEventListener('loadeddata', () => {
      if (this.ended || !this.source?.video) return;
      this.playsMovie = true;
      this.video.hidden = false;
      this.canvas.hidden = true;
      this.seek(this.frame);
      if (this.playing) this.play(true);
    });
    this.video.addEventListener('seeked', () => {
      if (this.wantedTime !== null && this.playsMovie) this.seekMovie(this.wantedTime);
    });
    this.video.addEventListener('ended', () => this.play(false));
  }

  get now(): number { return this.frame; }
  get isPlaying(): boolean { return this.playing; }

  show(source: FilmSource): void {
    this.source = source;
    this.playsMovie = false;
    this.wanted = -1;
    this.wantedTime = null;
    this.video.hidden = true;
    this.canvas.hidden = false;
    if (source.video) {
      this.video.src = source.video;
      this.video.load();
    } else {
      this.dropMovie();
    }
    this.root.dataset.colored = String(source.isColored);
    this.layOut();
    this.draw();
  }

  // A picture of the present frame in first colours; null: none.
  showEarly(url: string | null): void {
    this.early.hidden = !url;
    if (url) this.early.src = url;
    else this.early.removeAttribute('src');
  }

  seek(frame: number): void {
    this.frame = Math.min(Math.max(0, frame), this.times.length - 1);
    this.position = this.times[this.frame]!;
    this.showEarly(null);
    if (this.playsMovie) this.seekMovie(insideOf(this.times, this.frame) - this.times[0]!);
    else this.draw();
    this.on.frame(this.frame);
  }

  play(on: boolean): void {
    if (on && !this.loops && this.frame >= this.times.length - 1) this.seek(0);
    this.playing = on;
    if (on) this.showEarly(null);
    this.on.playing(on);
    if (this.playsMovie) {
      this.video.loop = this.loops;
      this.video.playbackRate = this.speed;
      if (on) this.startMovie();
      else this.video.pause();
    }
    this.last = performance.now();
    cancelAnimationFrame(this.ticking);
    if (on) this.ticking = requestAnimationFrame(() => this.tick());
  }
  setSpeed(speed: number): void {
    this.speed = speed;
    this.video.playbackRate = speed;
  }
  setLoop(on: boolean): void {
    this.loops = on;
    this.video.loop = on;
  }
  setSound(on: boolean): void {
    this.video.muted = !on;
  }
  setCompare(on: boolean): void {
    this.compares = on;
    this.layOut();
    if (on) this.divider.focus({ preventScroll: true });
  }

  destroy(): void {
    this.ended = true;
    this.play(false);
    this.dropMovie();
    this.source = undefined;
  }

  private dropMovie(): void {
    this.video.removeAttribute('src');
    this.video.load();
  }

  // One seek after the other: Chromium never ends a seek to the time of an earlier one that goes on.
  private seekMovie(seconds: number): void {
    this.wantedTime = this.video.seeking ? seconds : null;
    if (this.wantedTime === null) this.video.currentTime = seconds;
  }

  private startMovie(): void {
    this.video.play().catch((error: Error) => {
      if (error.name === 'AbortError' || !this.playing) return;
      if (error.name !== 'NotAllowedError' || this.video.muted) return this.playFrames();
      this.video.muted = true; // until somebody presses a button, browsers play in silence only
      this.startMovie();
    });
  }

  // The browser cannot play the movie.
  private playFrames(): void {
    if (this.ended || !this.source?.video) return;
    this.playsMovie = false;
    this.video.hidden = true;
    this.canvas.hidden = false;
    this.root.dataset.movie = 'no';
    this.draw();
  }

  private tick(): void {
    if (!this.playing || this.ended) return;
    const now = performance.now();
    let frame: number;
    if (this.playsMovie) {
      frame = this.wantedTime !== null ? this.frame : frameAt(this.times, this.video.currentTime + this.times[0]!);
    } else {
      this.position += this.speed * Math.min(1, (now - this.last) / 1000);
      const end = this.times[0]! + secondsOf(this.times);
      if (this.position >= end && !this.loops) {
        this.seek(this.times.length - 1);
        return this.play(false);
      }
      if (this.position >= end) this.position = this.times[0]! + ((this.position - end) % secondsOf(this.times));
      frame = frameAt(this.times, this.position);
    }
    this.last = now;
    if (frame !== this.frame) {
      this.frame = frame;
      this.on.frame(frame);
      if (!this.playsMovie) this.draw();
    }
    this.ticking = requestAnimationFrame(() => this.tick());
  }

  // Fetches the present frame; while one is on its way, only the last one that was asked for follows.
  private draw(): void {
    if (!this.source || this.playsMovie || this.ended) return;
    this.wanted = this.frame;
    if (!this.loading) void this.fetchFrames();
  }
  private async fetchFrames(): Promise<void> {
    this.loading = true;
    while (this.wanted >= 0 && this.source && !this.ended && !this.playsMovie) {
      const frame = this.wanted;
      this.wanted = -1;
      const pixels = Math.max(this.root.clientWidth, this.root.clientHeight) * devicePixelRatio;
      const side = Math.min(largestSide, Math.max(64, Math.ceil(pixels / 160) * 160));
      try {
        const response = await fetch(this.source.frame(frame, side));
        if (!response.ok) throw new Error((await response.json() as { error: { message: string } }).error.message);
        const picture = await createImageBitmap(await response.blob());
        this.canvas.width = picture.width;
        this.canvas.height = picture.height;
        this.canvas.getContext('2d')!.drawImage(picture, 0, 0);
        picture.close();
        this.root.dataset.drawn = String(frame);
      } catch (error) {
        if (!this.ended) this.on.trouble(`${clockOf(this.times[frame]!)}: ${(error as Error).message}`);
      }
    }
    this.loading = false;
  }

  private layOut(): void {
    const all = this.source !== undefined && !this.source.isColored && !this.source.isGray;
    const comparing = this.compares && this.source?.isColored === true;
    const share = comparing ? Number(this.divider.value) : all ? 100 : 0;
    this.gray.hidden = share === 0 && !comparing;
    this.gray.style.width = `${share}%`;
    this.line.style.left = `${share}%`;
    for (const element of [this.line, this.divider, this.dividerLabel]) element.hidden = !comparing;
    this.divider.setAttribute('aria-valuetext', `${share} % grey`);
  }
}

export const playerBar = (
  screen: { step: (frames: number) => void; toggle: () => void; speed: (value: number) => void; loop: (on: boolean) => void;
    compare: (on: boolean) => void; sound: (on: boolean) => void },
  hasSound: boolean,
): { root: HTMLElement; show: (state: { playing: boolean; clock: string; canCompare: boolean }) => void } => {
  const toggle = (text: string, id: string, on: boolean, act: (on: boolean) => void): HTMLButtonElement => {
    const button = h('button', { type: 'button', id, 'aria-pressed': String(on) }, text);
    button.addEventListener('click', () => {
      const next = button.getAttribute('aria-pressed') !== 'true';
      button.setAttribute('aria-pressed', String(next));
      act(next);
    });
    return button;
  };
  const play = h('button', { type: 'button', id: 'film-play', class: 'main-button', 'aria-keyshortcuts': 'Space', onclick: () => screen.toggle() }, 'Play');
  const clock = h('output', { id: 'film-clock', class: 'film-clock' });
  const compare = toggle('Compare', 'film-compare', false, screen.compare);
  const speed = h('select', { id: 'film-speed', 'aria-label': 'Speed', onchange: () => screen.speed(Number(speed.value)) });
  replace(speed, ...[['0.25', '¼ speed'], ['0.5', '½ speed'], ['1', 'Full speed'], ['2', 'Double speed']]
    .map(([value, text]) => h('option', { value: value!, selected: value === '1' }, text!)));
  const back = h('button', { type: 'button', id: 'film-back', 'aria-keyshortcuts': ',', title: 'One frame back (,)', onclick: () => screen.step(-1) }, '‹', h('span', { class: 'said' }, 'One frame back'));
  const on = h('button', { type: 'button', id: 'film-on', 'aria-keyshortcuts': '.', title: 'One frame on (.)', onclick: () => screen.step(1) }, '›', h('span', { class: 'said' }, 'One frame on'));
  const root = h('div', { class: 'film-bar', role: 'group', 'aria-label': 'Playing' }, play, back, on, clock,
    h('span', { class: 'film-gap' }), speed, toggle('Loop', 'film-loop', true, screen.loop),
    ...(hasSound ? [toggle('Sound', 'film-sound', true, screen.sound)] : []), compare);
  return {
    root,
    show: ({ playing, clock: text, canCompare }) => {
      play.textContent = playing ? 'Pause' : 'Play';
      clock.textContent = text;
      compare.hidden = !canCompare;
    },
  };
};
