// The live preview: one question at a time, always for the newest strokes, so that a service that is slower than the hand
// answers as often as it can and works on nothing that is not wanted any more.
import type { StrokeFile } from '../model/stroke_file';

export type PreviewSource = (strokes: StrokeFile, maxSide: number, signal: AbortSignal) => Promise<ImageBitmap>;
export type PreviewState = 'none' | 'waiting' | 'shown' | 'failed';
export interface PreviewEvents {
  picture(bitmap: ImageBitmap | null): void; // null: none any more
  state(state: PreviewState, problem?: string): void;
}

export class PreviewLoop {
  private timer: ReturnType<typeof setTimeout> | undefined;
  private running: AbortController | undefined;
  private wanted: { strokes: StrokeFile; maxSide: number } | undefined;

  constructor(
    private readonly source: PreviewSource | undefined,
    private readonly events: PreviewEvents,
    private readonly delay = 0, // ms; changes of one moment are one question
  ) {}

  // The strokes have changed, or what lies below them. An empty list has no preview.
  changed(strokes: StrokeFile, maxSide: number): void {
    if (!this.source) return;
    if (strokes.length === 0) {
      this.stop();
      this.events.picture(null);
      this.events.state('none');
      return;
    }
    this.wanted = { strokes, maxSide };
    this.events.state('waiting');
    clearTimeout(this.timer);
    if (!this.running) this.timer = setTimeout(() => void this.ask(), this.delay);
  }

  // Withdraws what is under way.
  stop(): void {
    clearTimeout(this.timer);
    this.wanted = undefined;
    this.running?.abort();
    this.running = undefined;
  }

  private async ask(): Promise<void> {
    const { strokes, maxSide } = this.wanted!;
    const controller = new AbortController();
    this.wanted = undefined;
    this.running = controller;
    try {
      const bitmap = await this.source!(strokes, maxSide, controller.signal);
      if (controller.signal.aborted) {
        bitmap.close();
        return;
      }
      this.events.picture(bitmap);
      if (!this.wanted) this.events.state('shown');
    } catch (error) {
      if (controller.signal.aborted) return;
      if (!this.wanted) this.events.state('failed', error instanceof Error ? error.message : String(error));
    }
    this.running = undefined;
    if (this.wanted) void this.ask();
  }
}
