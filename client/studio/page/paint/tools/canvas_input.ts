// Pointer, wheel and key events of the canvas, as samples of the photo and commands.
import { commandOfKey, takesKeys, type KeyCommand } from '../panel/shortcuts';
import type { Stage } from '../view/stage';
import { Gestures, penEraser, wheelFactor, type PointerSample } from './gestures';
import type { Sample } from './path';

export type Device = 'pointer' | 'pen' | 'eraser of pen' | 'keys';
export interface CanvasTarget {
  begin(sample: Sample, device: Device): boolean; // whether it goes on
  extend(samples: readonly Sample[], holdsAngle: boolean): void;
  end(): void;
  cancel(): void;
  pick(x: number, y: number): void;
  hover(x: number, y: number): void; // px of the photo
  command(command: KeyCommand): void;
}

const keyStep = 12; // px of the canvas that an arrow key moves the cross; with Shift 1

export class CanvasInput {
  private readonly gestures: Gestures;
  private readonly ends = new AbortController();
  private holdsAngle = false;
  private paintsByKeys = false;

  constructor(root: HTMLElement, private readonly stage: Stage, private readonly target: CanvasTarget) {
    this.gestures = new Gestures({
      begin: (sample) => void target.begin(this.onPhoto(sample),
        sample.button === penEraser ? 'eraser of pen' : sample.type === 'pen' ? 'pen' : 'pointer'),
      extend: (samples) => target.extend(samples.map((sample) => this.onPhoto(sample)), this.holdsAngle),
      end: () => target.end(),
      cancel: () => target.cancel(),
      pick: ({ x, y }) => target.pick(...stage.photoAt(x, y)),
      pan: (dx, dy) => stage.pan(dx, dy),
      zoom: (factor, x, y) => stage.zoom(factor, x, y),
    });
    const { canvas } = stage;
    const { signal } = this.ends;
    canvas.addEventListener('pointerdown', (event) => this.down(event), { signal });
    canvas.addEventListener('pointermove', (event) => this.move(event), { signal });
    canvas.addEventListener('pointerup', (event) => this.gestures.up(event.pointerId), { signal });
    canvas.addEventListener('pointercancel', (event) => this.gestures.lost(event.pointerId), { signal });
    canvas.addEventListener('pointerleave', () => this.setCursor(undefined), { signal });
    // Who comes with the mouse has the keys at hand, unless they belong to something else.
    canvas.addEventListener('pointerenter', () => {
      if (document.activeElement === document.body) canvas.focus({ preventScroll: true });
    }, { signal });
    canvas.addEventListener('contextmenu', (event) => event.preventDefault(), { signal });
    canvas.addEventListener('wheel', (event) => {
      event.preventDefault();
      if (event.shiftKey) return stage.pan(-(event.deltaX || event.deltaY), 0);
      const { x, y } = this.sample(event, undefined);
      stage.zoom(wheelFactor(event.deltaY, event.deltaMode, event.ctrlKey), x, y);
    }, { signal, passive: false });
    root.addEventListener('keydown', (event) => this.keyDown(event), { signal });
    root.addEventListener('keyup', (event) => this.keyUp(event), { signal });
    window.addEventListener('blur', () => this.released(), { signal });
    canvas.addEventListener('blur', () => this.stopKeys(), { signal });
  }

  destroy(): void {
    this.ends.abort();
  }

  private onPhoto({ x, y, pressure }: PointerSample): Sample {
    const [px, py] = this.stage.photoAt(x, y);
    return { x: px, y: py, pressure };
  }
  private sample(event: MouseEvent, pointer: PointerEvent | undefined): PointerSample {
    const box = this.stage.canvas.getBoundingClientRect();
    return {
      id: pointer?.pointerId ?? 0,
      type: pointer?.pointerType ?? 'mouse',
      button: event.button,
      x: event.clientX - box.left,
      y: event.clientY - box.top,
      pressure: pointer?.pressure ?? 0.5,
    };
  }

  private down(event: PointerEvent): void {
    const { canvas } = this.stage;
    canvas.focus({ preventScroll: true });
    event.preventDefault();
    canvas.setPointerCapture(event.pointerId);
    this.stopKeys();
    this.holdsAngle = event.shiftKey;
    const sample = this.sample(event, event);
    this.setCursor(event.pointerType === 'touch' ? undefined : sample);
    this.gestures.pickKey = event.altKey;
    this.gestures.down(sample, event.timeStamp);
  }
  private move(event: PointerEvent): void {
    const last = this.sample(event, event);
    this.holdsAngle = event.shiftKey;
    // All places since the last frame, not only the newest.
    const coalesced = event.getCoalescedEvents?.() ?? [];
    this.gestures.move(coalesced.length ? coalesced.map((one) => this.sample(one, one)) : [last]);
    if (event.pointerType === 'touch') return;
    this.setCursor(last);
    if (!event.buttons) this.target.hover(...this.stage.photoAt(last.x, last.y));
  }

  private setCursor(sample: { x: number; y: number } | undefined): void {
    if (this.paintsByKeys) return;
    this.stage.cursor = sample && { x: sample.x, y: sample.y, isCross: false };
    this.stage.redraw(true);
  }

  private keyDown(event: KeyboardEvent): void {
    const target = event.target as HTMLElement;
    if (takesKeys(target.tagName, (target as HTMLInputElement).type ?? '')) return;
    if (target.closest('dialog')) return;
    const isOnCanvas = target === this.stage.canvas;
    if (isOnCanvas && this.canvasKey(event)) {
      event.preventDefault();
      return;
    }
    const command = commandOfKey(event);
    if (!command) return;
    event.preventDefault();
    this.target.command(command);
  }
  private canvasKey(event: KeyboardEvent): boolean {
    if (event.key === ' ') {
      this.gestures.panKey = true;
      this.stage.root.dataset.grab = '';
      return true;
    }
    if (event.key === 'Escape' && this.paintsByKeys) {
      this.paintsByKeys = false;
      this.target.cancel();
      return true;
    }
    if (event.ctrlKey || event.metaKey || event.altKey) return false;
    const arrow = ({ ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] } as
      Record<string, [number, number]>)[event.key];
    if (arrow) {
      if (this.gestures.panKey) this.stage.panByShare(-arrow[0], -arrow[1]);
      else this.moveCross(arrow[0] * (event.shiftKey ? 1 : keyStep), arrow[1] * (event.shiftKey ? 1 : keyStep));
      return true;
    }
    if (event.key !== 'Enter' || event.repeat) return false;
    const place = this.cross();
    if (this.paintsByKeys) {
      this.stopKeys();
    } else {
      this.paintsByKeys = this.target.begin(place, 'keys');
    }
    return true;
  }
  private cross(): Sample {
    const { width, height } = this.stage.size;
    const { x, y } = this.stage.cursor ?? { x: width / 2, y: height / 2 };
    this.stage.cursor = { x, y, isCross: true };
    this.stage.redraw(true);
    const [px, py] = this.stage.photoAt(x, y);
    return { x: px, y: py, pressure: 0.5 };
  }
  private moveCross(dx: number, dy: number): void {
    this.cross();
    const { width, height } = this.stage.size;
    const { x, y } = this.stage.cursor!;
    this.stage.cursor = {
      x: Math.min(width - 1, Math.max(0, x + dx)), y: Math.min(height - 1, Math.max(0, y + dy)), isCross: true,
    };
    const place = this.cross();
    if (this.paintsByKeys) this.target.extend([place], false);
    else this.target.hover(place.x, place.y);
  }
  private stopKeys(): void {
    if (!this.paintsByKeys) return;
    this.paintsByKeys = false;
    this.target.end();
  }

  private keyUp(event: KeyboardEvent): void {
    if (event.key === ' ') this.released();
  }
  private released(): void {
    this.gestures.panKey = false;
    delete this.stage.root.dataset.grab;
  }
}
