// What pointers mean: one paints, two fingers or the middle button move the view. A second finger that comes early
// takes back the stroke that the first had begun. Fingers only move the view once a pen was seen, so that a resting
// hand leaves no marks.

export interface PointerSample {
  readonly id: number;
  readonly type: string; // "mouse", "pen", "touch"
  readonly button: number; // of pointerdown: 0 first, 1 middle, 2 second, 5 the eraser of a pen
  readonly x: number; // CSS px of the canvas
  readonly y: number;
  readonly pressure: number;
}
export interface GestureTarget {
  begin(sample: PointerSample): void;
  extend(samples: readonly PointerSample[]): void;
  end(): void;
  cancel(): void;
  pick(sample: PointerSample): void;
  pan(dx: number, dy: number): void;
  zoom(factor: number, x: number, y: number): void;
}

export const penEraser = 5;
const earlyDistance = 12; // px that a finger may have painted when the second comes
const earlyTime = 250; // ms

type Mode = 'idle' | 'paint' | 'pan' | 'pinch' | 'wait';

export class Gestures {
  panKey = false; // while the space bar is down
  pickKey = false; // while Alt is down
  private mode: Mode = 'idle';
  private pointers = new Map<number, PointerSample>();
  private began: { sample: PointerSample; time: number; moved: number } | undefined;
  private sawPen = false;

  constructor(private readonly target: GestureTarget) {}

  get isPainting(): boolean {
    return this.mode === 'paint';
  }

  // `time`: ms.
  down(sample: PointerSample, time: number): void {
    this.pointers.set(sample.id, sample);
    if (sample.type === 'pen') this.sawPen = true;
    if (this.pointers.size > 1) {
      this.second(sample, time);
      return;
    }
    if (sample.button === 1 || this.panKey || (sample.type === 'touch' && this.sawPen)) {
      this.mode = 'pan';
    } else if (sample.button === 2 || this.pickKey) {
      this.mode = 'wait';
      this.target.pick(sample);
    } else if (sample.button === 0 || sample.button === penEraser) {
      this.mode = 'paint';
      this.began = { sample, time, moved: 0 };
      this.target.begin(sample);
    }
  }

  // `samples`: the coalesced places of one pointer, oldest first.
  move(samples: readonly PointerSample[]): void {
    const last = samples.at(-1);
    const before = last && this.pointers.get(last.id);
    if (!last || !before) return;
    if (this.mode === 'paint' && this.began?.sample.id === last.id) {
      this.began.moved = Math.max(
        this.began.moved, Math.hypot(last.x - this.began.sample.x, last.y - this.began.sample.y));
      this.target.extend(samples);
    } else if (this.mode === 'pan') {
      this.target.pan(last.x - before.x, last.y - before.y);
    } else if (this.mode === 'pinch') {
      this.pinch(before, last);
    }
    this.pointers.set(last.id, last);
  }

  up(id: number): void {
    if (!this.pointers.delete(id)) return;
    if (this.mode === 'paint' && this.began?.sample.id === id) this.target.end();
    else if (this.mode === 'paint') return;
    // After two fingers the one that is left does not paint.
    this.mode = this.pointers.size === 0 ? 'idle' : this.mode === 'pinch' ? 'pan' : 'wait';
  }

  lost(id: number): void {
    if (this.mode === 'paint' && this.began?.sample.id === id) {
      this.target.cancel();
      this.mode = 'wait';
    }
    this.up(id);
  }

  private second(sample: PointerSample, time: number): void {
    if (this.mode === 'paint') {
      const early = this.began && (this.began.moved < earlyDistance || time - this.began.time < earlyTime);
      const fingers = sample.type === 'touch' && this.began?.sample.type === 'touch';
      if (!early || !fingers) return; // the stroke goes on
      this.target.cancel();
    }
    if (this.pointers.size === 2) this.mode = 'pinch';
  }

  private pinch(before: PointerSample, now: PointerSample): void {
    const other = [...this.pointers.values()].find(({ id }) => id !== now.id);
    if (!other) return;
    const length = (p: PointerSample) => Math.max(Math.hypot(p.x - other.x, p.y - other.y), 1);
    const middle = (p: PointerSample) => [(p.x + other.x) / 2, (p.y + other.y) / 2];
    const [x, y] = middle(now), [x0, y0] = middle(before);
    this.target.pan(x - x0, y - y0);
    this.target.zoom(length(now) / length(before), x, y);
  }
}

// The factor of a turn of the wheel: lines and pages of old mice count as px. A pinch on a touchpad comes as a wheel
// with Ctrl, in smaller steps.
export const wheelFactor = (deltaY: number, deltaMode: number, isPinch = false): number => {
  const px = deltaY * (deltaMode === 1 ? 16 : deltaMode === 2 ? 400 : 1) * (isPinch ? 5 : 1);
  return Math.exp(-Math.max(-300, Math.min(300, px)) / 500);
};
