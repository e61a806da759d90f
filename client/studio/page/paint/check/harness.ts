// A page with nothing but the painter, for the browser test.
import { Painter, parseStrokes, serializeStrokes, type StrokeFile } from '../index';
import { maskOf } from '../raster/mask';
import { german } from './german';

const width = 400, height = 300;

const contextOf = (w: number, h: number): CanvasRenderingContext2D => {
  const canvas = document.createElement('canvas');
  canvas.width = w;
  canvas.height = h;
  return canvas.getContext('2d')!;
};

// A bright disc of radius 60 around (280, 150) on a dark ground, with grain.
const drawnPhoto = async (): Promise<ImageBitmap> => {
  const context = contextOf(width, height);
  const picture = context.createImageData(width, height);
  let seed = 9;
  for (let i = 0; i < width * height; ++i) {
    const isDisc = Math.hypot((i % width) - 280, Math.floor(i / width) - 150) < 60;
    const gray = (isDisc ? 170 : 80) + ((seed = (seed * 48271) % 2147483647) % 9);
    picture.data.set([gray, gray, gray, 255], 4 * i);
  }
  context.putImageData(picture, 0, 0);
  return createImageBitmap(context.canvas);
};

const bitmapOf = async (base64: string): Promise<ImageBitmap> => {
  const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  return createImageBitmap(new Blob([bytes]));
};

const heard = { changes: 0, asked: 0, aborted: 0, sides: [] as number[] };

// Stands in for the service: the strokes, blurred. It answers late, as a service does.
const blurred = (photo: ImageBitmap) =>
  async (strokes: StrokeFile, maxSide: number, signal: AbortSignal): Promise<ImageBitmap> => {
    ++heard.asked;
    heard.sides.push(maxSide);
    await new Promise((done) => setTimeout(done, 60));
    if (signal.aborted) {
      ++heard.aborted;
      throw new DOMException('withdrawn', 'AbortError');
    }
    const share = Math.min(1, maxSide / Math.max(photo.width, photo.height));
    const colors = contextOf(photo.width * share, photo.height * share);
    colors.scale(share, share);
    for (const entry of strokes) {
      colors.fillStyle = colors.strokeStyle = entry.color ?? '#808080';
      const mask = maskOf(entry, photo);
      const step = Math.max(1, Math.round(1 / share));
      for (let y = 0; y < mask.height; y += step) {
        for (let x = 0; x < mask.width; x += step) {
          if (mask.data[y * mask.width + x]) colors.fillRect(mask.x + x - 20, mask.y + y - 20, 40, 40);
        }
      }
    }
    const context = contextOf(colors.canvas.width, colors.canvas.height);
    context.drawImage(photo, 0, 0, context.canvas.width, context.canvas.height);
    context.globalCompositeOperation = 'saturation';
    context.fillStyle = '#808080';
    context.fillRect(0, 0, context.canvas.width, context.canvas.height);
    context.globalCompositeOperation = 'color';
    context.filter = `blur(${Math.round(12 * share)}px)`;
    context.drawImage(colors.canvas, 0, 0);
    return createImageBitmap(context.canvas);
  };

let painter: Painter | undefined;
let photo: ImageBitmap;

const harness = {
  heard,
  async mount(options: { photo?: string; language?: 'german'; preview?: boolean } = {}): Promise<void> {
    painter?.destroy();
    photo = options.photo ? await bitmapOf(options.photo) : await drawnPhoto();
    painter = new Painter(document.getElementById('host')!, {
      photo,
      preview: options.preview ? blurred(photo) : undefined,
      onChange: () => ++heard.changes,
      texts: options.language === 'german' ? german : undefined,
    });
    painter.focus();
    await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  },
  bytes: (): string => serializeStrokes(painter!.strokes()),
  load: (text: string): void => painter!.load(parseStrokes(text)),
  // A picture in one colour, as an automatic colourizer's.
  async automatic(color: string): Promise<void> {
    const context = contextOf(40, 30);
    context.fillStyle = color;
    context.fillRect(0, 0, 40, 30);
    painter!.setAutomatic(await createImageBitmap(context.canvas));
  },
  // The pixels that entry `index` covers: how many of them inside of the disc, and outside.
  inDisc(index: number): { inside: number; outside: number } {
    const mask = maskOf(painter!.strokes()[index], photo);
    const found = { inside: 0, outside: 0 };
    mask.data.forEach((v, i) => {
      const x = mask.x + (i % mask.width), y = mask.y + Math.floor(i / mask.width);
      if (v) ++found[Math.hypot(x - 280, y - 150) < 60 ? 'inside' : 'outside'];
    });
    return found;
  },
  destroy(): number {
    painter!.destroy();
    painter = undefined;
    return document.getElementById('host')!.childElementCount;
  },
};
export type Harness = typeof harness;
(window as unknown as { harness: Harness }).harness = harness;
