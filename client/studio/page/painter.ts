// Where the painter of the key view is mounted. Null while a build has none.
export type StrokeFile = readonly unknown[];

export interface PainterOptions {
  photo: ImageBitmap;
  preview?: (strokes: StrokeFile, maxSide: number, signal: AbortSignal) => Promise<ImageBitmap>;
  onChange?: (strokes: StrokeFile) => void;
}

export interface PainterOfKeyView {
  load(strokes: StrokeFile): void;
  strokes(): StrokeFile;
  setAutomatic(picture: ImageBitmap | null): void;
  destroy(): void;
}

export const painterClass: (new (host: HTMLElement, options: PainterOptions) => PainterOfKeyView) | null = null;
