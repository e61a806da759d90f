// The live preview: asks a little after the last change, withdraws what is no longer wanted, never waits.
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

  constructor(
    private readonly source: PreviewSource | undefined,
    private readonly events: PreviewEvents,
    private readonly delay = 80, // ms
  ) {}

  // The strokes have changed. An empty list has no preview.
  changed(strokes: StrokeFile, maxSide: number): void {
    this.stop();
    if (!this.source) return;
    if (strokes.length === 0) {
      this.events.picture(null);
      this.events.state('none');
      return;
    }
    this.events.state('waiting');
    this.timer = setTimeout(() => void this.ask(strokes, maxSide), this.delay);
  }

  stop(): void {
    clearTimeout(this.timer);
    this.running?.abort();
    this.running = undefined;
  }

  private async ask(strokes: StrokeFile, maxSide: number): Promise<void> {
    const controller = new AbortController();
    this.running = controller;
    try {
      const bitmap = await this.source!(strokes, maxSide, controller.signal);
      if (controller.signal.aborted) {
        bitmap.close();
        return;
      }
      this.events.picture(bitmap);
      this.events.state('shown');
    } catch (error) {
      if (controller.signal.aborted) return;
      this.events.state('failed', error instanceof Error ? error.message : String(error));
    }
  }
}
