// The pictures of the canvas from bottom to top: the photo in grey, the colours below the strokes, the preview, the
// strokes.
import type { Luminance } from '../region/edge_weights';
import { luminanceFromBytes } from '../color/lab';
import { isDisc, isLine, isRegion, type StrokeEntry, type StrokeFile } from '../model/stroke_file';
import type { Size } from '../raster/mask';
import type { Settings } from '../tools/settings';
import { canvasOf } from './canvas';
import type { Paints } from './stroke_drawing';
import { StrokeLayer, type Live } from './stroke_layer';
import { toPhoto, type View } from './view_transform';

const smallSide = 2048; // px of the photo's smaller copy, enough for most windows
const luminanceSide = 1024; // px of the luminance that the region tool grows on

const withoutColor = (context: CanvasRenderingContext2D, x: number, y: number, w: number, h: number): void => {
  context.globalCompositeOperation = 'saturation';
  context.fillStyle = '#808080';
  context.fillRect(x, y, w, h);
  context.globalCompositeOperation = 'source-over';
};

const reduced = (bitmap: ImageBitmap, side: number): [HTMLCanvasElement, CanvasRenderingContext2D] => {
  const share = Math.min(1, side / Math.max(bitmap.width, bitmap.height));
  const made = canvasOf(bitmap.width * share, bitmap.height * share);
  made[1].imageSmoothingQuality = 'high';
  made[1].drawImage(bitmap, 0, 0, made[0].width, made[0].height);
  return made;
};

export class PhotoLayers {
  readonly size: Size;
  preview: ImageBitmap | null = null;
  private automatic_: ImageBitmap | null = null;
  private readonly small: { gray: HTMLCanvasElement; own: HTMLCanvasElement };
  private luminance_: Luminance | undefined;
  private hasColor_ = false;
  private readonly strokes = new StrokeLayer();

  constructor(private readonly photo: ImageBitmap) {
    this.size = { width: photo.width, height: photo.height };
    const [own] = reduced(photo, smallSide);
    const [gray, context] = canvasOf(own.width, own.height);
    context.drawImage(own, 0, 0);
    withoutColor(context, 0, 0, gray.width, gray.height);
    this.small = { gray, own };
  }

  get automatic(): ImageBitmap | null {
    return this.automatic_;
  }
  setAutomatic(bitmap: ImageBitmap | null): void {
    this.automatic_ = bitmap;
    this.strokes.forget();
  }

  // L of the photo at a smaller size.
  get luminance(): Luminance {
    if (this.luminance_) return this.luminance_;
    const [canvas, context] = reduced(this.photo, luminanceSide);
    const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
    const values = new Float32Array(canvas.width * canvas.height);
    let colored = 0;
    for (let i = 0; i < values.length; ++i) {
      const r = data[4 * i], g = data[4 * i + 1], b = data[4 * i + 2];
      values[i] = luminanceFromBytes(r, g, b);
      if (Math.max(r, g, b) - Math.min(r, g, b) > 24) ++colored;
    }
    this.hasColor_ = colored > 0.01 * values.length;
    return (this.luminance_ = { width: canvas.width, height: canvas.height, data: values });
  }
  // Whether the photo is not monochrome.
  get hasColor(): boolean {
    return this.luminance && this.hasColor_;
  }
  // undefined outside of the photo.
  luminanceAt(x: number, y: number): number | undefined {
    if (!(x >= 0 && y >= 0 && x < this.size.width && y < this.size.height)) return undefined;
    const { width, height, data } = this.luminance;
    return data[Math.floor((y / this.size.height) * height) * width + Math.floor((x / this.size.width) * width)];
  }
  private luminanceUnder = (entry: StrokeEntry): number => {
    const points = isLine(entry) ? entry.line : isRegion(entry) ? entry.region : [];
    const places = isDisc(entry) ? [[entry.x, entry.y] as const] : points;
    const step = Math.max(1, Math.floor(places.length / 16));
    const values = places.filter((_, i) => i % step === 0).map(([x, y]) => this.luminanceAt(x, y) ?? 60);
    return values.reduce((sum, v) => sum + v, 0) / Math.max(values.length, 1);
  };

  // The colour ("r, g, b" 0..255) of a picture of the photo's shape at a place of the photo.
  colorAt(bitmap: ImageBitmap | 'photo', x: number, y: number): Uint8ClampedArray {
    const source = bitmap === 'photo' ? this.photo : bitmap;
    const [, context] = canvasOf(1, 1);
    const sx = Math.floor((x / this.size.width) * source.width);
    const sy = Math.floor((y / this.size.height) * source.height);
    context.drawImage(source, sx, sy, 1, 1, 0, 0, 1, 1);
    return context.getImageData(0, 0, 1, 1).data;
  }

  // `ratio`: device px a CSS px. While the view moves, many strokes are shown as they were drawn before, moved along;
  // returns whether they were, and are to be drawn again when it rests.
  draw(context: CanvasRenderingContext2D, view: View, ratio: number, entries: StrokeFile, live: Live | undefined,
    settings: Settings, isMoving = false): boolean {
    const { width, height } = context.canvas;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, width, height);
    context.setTransform(ratio * view.scale, 0, 0, ratio * view.scale, ratio * view.x, ratio * view.y);
    context.imageSmoothingEnabled = ratio * view.scale < 4; // pixels are seen as such when they are large
    context.imageSmoothingQuality = ratio * view.scale < 1 ? 'medium' : 'low';
    this.drawPhoto(context, view, ratio, settings);
    if (settings.isComparing) return false;
    for (const [layer, bitmap] of [['automatic', this.automatic_], ['preview', this.preview]] as const) {
      const { isShown, opacity } = settings.layers[layer];
      if (!isShown || !bitmap) continue;
      context.globalAlpha = opacity;
      context.drawImage(bitmap, 0, 0, this.size.width, this.size.height);
      context.globalAlpha = 1;
    }
    const { isShown, opacity } = settings.layers.strokes;
    if (!isShown) return false;
    const picture = this.strokes.picture({
      view, ratio, canvas: { width, height }, entries, live, isSolid: settings.isSolid, isMoving,
      paints: (on) => this.paints(on, settings),
    });
    context.save();
    context.beginPath(); // nothing counts beyond the photo
    context.rect(0, 0, this.size.width, this.size.height);
    context.clip();
    const grown = view.scale / picture.view.scale;
    context.setTransform(grown, 0, 0, grown, ratio * (view.x - grown * picture.view.x),
      ratio * (view.y - grown * picture.view.y));
    context.globalAlpha = opacity;
    context.globalCompositeOperation = settings.isSolid ? 'source-over' : 'color';
    context.drawImage(picture.canvas, 0, 0);
    context.restore();
    return picture.view !== view;
  }

  private drawPhoto(context: CanvasRenderingContext2D, view: View, ratio: number, settings: Settings): void {
    const { width, height } = this.size;
    const copy = settings.hasPhotoColors ? this.small.own : this.small.gray;
    if (copy.width >= width || ratio * view.scale * width <= copy.width * 1.2) {
      context.drawImage(copy, 0, 0, width, height);
      return;
    }
    // The part in sight of the photo itself.
    const [left, top] = toPhoto(view, 0, 0);
    const [right, bottom] = toPhoto(view, context.canvas.width / ratio, context.canvas.height / ratio);
    const x = Math.max(0, Math.floor(left)), y = Math.max(0, Math.floor(top));
    const w = Math.min(width, Math.ceil(right)) - x, h = Math.min(height, Math.ceil(bottom)) - y;
    if (w <= 0 || h <= 0) return;
    context.drawImage(this.photo, x, y, w, h, x, y, w, h);
    if (!settings.hasPhotoColors) withoutColor(context, x, y, w, h);
  }

  private paints(context: CanvasRenderingContext2D, settings: Settings): Paints {
    let automatic: CanvasPattern | string = '#8a8f94';
    if (this.automatic_) {
      const pattern = context.createPattern(this.automatic_, 'no-repeat');
      pattern?.setTransform(new DOMMatrix([
        this.size.width / this.automatic_.width, 0, 0, this.size.height / this.automatic_.height, 0, 0]));
      automatic = pattern ?? automatic;
    }
    return { luminanceUnder: settings.isSolid ? undefined : this.luminanceUnder, automatic };
  }
}
