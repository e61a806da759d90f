// The page of the scene in a sandboxed frame, and messages with it (core/view/page/framed.js). A new version is loaded
// behind the one that is shown. Messages of other windows, and such that are not as described there, are ignored.
import { h } from '../../dom';
import type { Gain } from '../model/tone';
import type { ChangeMap } from './changes';

const patience = 1500; // ms

export interface ScenePlace { readonly photo: string; readonly x: number; readonly y: number }
export interface SceneHooks {
  ready(url: string): void;
  picked(place: ScenePlace): void;
  held(photo: string | null): void;
  recolored(): void;
}
export interface SceneLook { shades?: 0 | 1 | 2; tone?: Gain; photo?: string; bare?: true }

const isShare = (value: unknown): value is number => typeof value === 'number' && value >= 0 && value <= 1;
const isName = (value: unknown): value is string => typeof value === 'string' && value.length > 0 && value.length <= 1024;

export type SceneMessage =
  | { kind: 'ready' } | { kind: 'recolored' } | { kind: 'drawn' } | { kind: 'held'; photo: string | null } | ({ kind: 'picked' } & ScenePlace);
// null: not a message of a scene's page.
export const readMessage = (data: unknown): SceneMessage | null => {
  if (data === null || typeof data !== 'object') return null;
  const { color3d, photo, x, y } = data as Record<string, unknown>;
  if (color3d === 'ready' || color3d === 'recolored' || color3d === 'drawn') return { kind: color3d };
  if (color3d === 'held' && (photo === null || isName(photo))) return { kind: 'held', photo };
  if (color3d === 'picked' && isName(photo) && isShare(x) && isShare(y)) return { kind: 'picked', photo, x, y };
  return null;
};

export class SceneFrame {
  readonly root = h('div', { class: 'co-scene' });
  private shown: HTMLIFrameElement | null = null;
  private coming: HTMLIFrameElement | null = null;
  private next: SceneLook | null = null;
  private waiting: ReturnType<typeof setTimeout> | undefined; // a look was sent that is not drawn yet
  private readonly listen = (event: MessageEvent): void => this.receive(event);

  constructor(private readonly hooks: SceneHooks) {
    addEventListener('message', this.listen);
  }

  load(url: string): void {
    if (this.coming?.getAttribute('src') === url || (!this.coming && this.shown?.getAttribute('src') === url)) return;
    this.coming?.remove();
    const frame = h('iframe', { src: url, sandbox: 'allow-scripts allow-pointer-lock', title: 'The coloured scene', class: 'scene', id: 'scene' });
    this.coming = frame;
    if (this.shown) {
      frame.removeAttribute('id');
      frame.classList.add('co-coming');
      frame.tabIndex = -1;
    }
    this.root.append(frame);
  }
  // One look at a time: the newest waits until the one before is drawn, so that the page itself stays quick.
  show(look: SceneLook): void {
    if (!this.shown) return;
    if (this.waiting !== undefined) {
      this.next = { ...this.next, ...look };
      return;
    }
    this.next = null;
    this.waiting = setTimeout(() => this.drawn(), patience); // a frame out of sight does not draw
    // The frame has no origin; what is sent is no secret.
    this.shown.contentWindow?.postMessage({ color3d: 'show', ...look }, '*');
  }
  // Changes the colours of the scene that is shown; no maps: as it is in its file.
  recolor(maps: readonly ChangeMap[]): void {
    this.shown?.contentWindow?.postMessage({ color3d: 'recolor', maps }, '*', maps.map(({ ab }) => ab.buffer as ArrayBuffer));
  }
  destroy(): void {
    removeEventListener('message', this.listen);
    clearTimeout(this.waiting);
    this.root.replaceChildren();
  }

  private drawn(): void {
    clearTimeout(this.waiting);
    this.waiting = undefined;
    if (this.next) this.show(this.next);
  }
  private receive({ source, origin, data }: MessageEvent): void {
    const frame = [this.coming, this.shown].find((one) => one && one.contentWindow === source);
    if (!frame || origin !== 'null') return;
    const message = readMessage(data);
    if (!message) return;
    if (message.kind === 'ready') {
      if (frame !== this.coming) return;
      this.shown?.remove();
      this.shown = frame;
      this.coming = null;
      this.next = null;
      this.drawn();
      frame.id = 'scene';
      frame.classList.remove('co-coming');
      frame.removeAttribute('tabindex');
      this.hooks.ready(frame.getAttribute('src')!);
    } else if (frame === this.shown) {
      if (message.kind === 'picked') this.hooks.picked(message);
      else if (message.kind === 'held') this.hooks.held(message.photo);
      else if (message.kind === 'recolored') this.hooks.recolored();
      else this.drawn();
    }
  }
}
