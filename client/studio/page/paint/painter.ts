// The canvas on which a key view is coloured, with its tools. Needs nothing but a browser.
//   const painter = new Painter(host, { photo, preview, onChange });
//   painter.load(strokes); painter.strokes(); painter.setAutomatic(picture); painter.destroy();
import { hexFromBytes } from './color/lab';
import { withRecent } from './color/palette';
import { StrokeDocument } from './model/document';
import {
  checkInside, checkStrokes, parseStrokes, serializeStrokes, type Fill, type StrokeEntry, type StrokeFile,
} from './model/stroke_file';
import { actionBar } from './panel/action_bar';
import { colorPanel } from './panel/color_panel';
import { element } from './panel/dom';
import { layerPanel } from './panel/layer_panel';
import { palettePanel } from './panel/palette_panel';
import { shortcutDialog, type KeyCommand } from './panel/shortcuts';
import { adoptStyle } from './panel/style';
import { toolPanel, toolRow } from './panel/tool_panel';
import { covers } from './raster/mask';
import { english, filled, type Texts } from './texts';
import { beginAction, type Action, type ActionInput } from './tools/actions';
import { CanvasInput, type Device } from './tools/canvas_input';
import type { Sample } from './tools/path';
import { firstSettings, largestWidth, recentLimit, SettingsStore, sliderOfWidth, widthOfSlider } from './tools/settings';
import { PreviewLoop, type PreviewSource } from './view/preview';
import { Stage } from './view/stage';

export interface PainterOptions {
  readonly photo: ImageBitmap;
  // Colours of the strokes in a picture of at most `maxSide` px, asked a little after each change.
  readonly preview?: PreviewSource;
  readonly onChange?: (strokes: StrokeFile) => void;
  // Words of another language.
  readonly texts?: Partial<Texts>;
}

const previewSide = 1000; // px
const noteTime = 5000; // ms

export class Painter {
  private readonly texts: Texts;
  private readonly store: SettingsStore;
  private readonly document: StrokeDocument;
  private readonly stage: Stage;
  private readonly input: CanvasInput;
  private readonly previews: PreviewLoop;
  private readonly root: HTMLElement;
  private readonly bar;
  private readonly layers;
  private readonly note = element('span', { role: 'status', class: 'paint-said' });
  private readonly previewNote = element('span', { class: 'paint-preview' });
  private readonly fileInput = element('input', { type: 'file', accept: '.json,application/json', hidden: true });
  private readonly dialog: HTMLDialogElement;
  private action: Action | undefined;
  private noteTimer: ReturnType<typeof setTimeout> | undefined;
  private changedAt = 0; // ms
  private luminanceTimer: ReturnType<typeof setTimeout> | undefined;

  constructor(host: HTMLElement, private readonly options: PainterOptions) {
    adoptStyle();
    this.texts = { ...english, ...options.texts };
    const { texts } = this;
    const longerSide = Math.max(options.photo.width, options.photo.height);
    this.store = new SettingsStore(firstSettings(longerSide));
    this.document = new StrokeDocument((isLoad) => this.changed(isLoad));
    this.stage = new Stage(options.photo, {
      settings: () => this.store.now,
      entries: () => this.document.entries,
      live: () => this.action,
    }, () => this.showState());
    this.previews = new PreviewLoop(options.preview, {
      picture: (bitmap) => this.setPreview(bitmap),
      state: (state, problem) => {
        this.previewNote.classList.toggle('paint-busy', state === 'waiting');
        this.previewNote.textContent = state === 'waiting' ? texts.previewWaiting
          : state === 'failed' ? filled(texts.previewFailed, problem ?? '') : '';
        this.root.dataset.preview = state;
        if (state === 'shown') this.root.dataset.previewMs = String(Math.round(performance.now() - this.changedAt));
      },
    });
    this.bar = actionBar({
      undo: () => this.command('undo'),
      redo: () => this.command('redo'),
      zoom: (factor) => this.stage.zoom(factor),
      fit: () => this.command('fit'),
      fullSize: () => this.command('fullSize'),
      compare: () => this.command('compare'),
      clear: () => this.document.replaceAll(texts.clear, []),
      open: () => this.command('open'),
      save: () => this.command('save'),
      shortcuts: () => this.command('shortcuts'),
    }, texts);
    this.layers = layerPanel(this.store, this.stage.layers.hasColor, texts);
    this.layers.setAvailable('automatic', false);
    this.layers.setAvailable('preview', options.preview !== undefined);
    this.dialog = shortcutDialog(texts);
    this.stage.canvas.setAttribute('aria-label', texts.canvas);
    this.stage.root.append(element('div', { class: 'paint-notes' }, this.note, this.previewNote));
    const grid = element('div', { class: 'paint-grid' }, this.bar.root,
      toolRow(this.store, texts, (isOpen) => {
        grid.dataset.side = isOpen ? 'open' : 'closed';
      }),
      this.stage.root,
      element('div', { class: 'paint-side' }, toolPanel(this.store, longerSide, texts), colorPanel(this.store, texts),
        palettePanel(this.store, texts, (text) => this.say(text)), this.layers.root));
    this.root = element('div', { class: 'paint', lang: texts.language }, grid, this.dialog, this.fileInput);
    this.root.dataset.preview = 'none';
    this.input = new CanvasInput(this.root, this.stage, {
      begin: (sample, device) => this.begin(sample, device),
      extend: (samples, holdsAngle) => {
        this.action?.extend(samples, holdsAngle);
        this.stage.redraw();
      },
      end: () => this.end(),
      cancel: () => {
        this.action = undefined;
        this.stage.redraw();
      },
      pick: (x, y) => this.pick(x, y),
      hover: (x, y) => this.hover(x, y),
      command: (command) => this.command(command),
    });
    this.fileInput.addEventListener('change', () => void this.openFile());
    this.store.onChange((now, before) => {
      if (now.luminance !== before.luminance) return;
      this.stage.root.dataset.tool = now.tool;
      this.stage.redraw();
      this.showState();
    });
    this.stage.root.dataset.tool = this.store.now.tool;
    host.append(this.root);
    this.showState();
  }

  // Shows these strokes and forgets the history; onChange does not hear of it. Throws StrokeFileError, naming the entry, if the service would
  // refuse them.
  load(strokes: StrokeFile): void {
    const checked = checkStrokes(strokes);
    checkInside(checked, this.options.photo.width, this.options.photo.height);
    this.document.reset(checked);
  }
  strokes(): StrokeFile {
    return this.document.entries;
  }
  // The colours that lie below the strokes, of the photo's shape; null: none. Their source is asked for a new preview.
  setAutomatic(picture: ImageBitmap | null): void {
    this.stage.layers.setAutomatic(picture);
    this.layers.setAvailable('automatic', picture !== null);
    this.askPreview();
    this.stage.redraw();
  }
  // Gives the canvas the keys. The keys count while the focus is anywhere in the painter.
  focus(): void {
    this.stage.canvas.focus({ preventScroll: true });
  }
  destroy(): void {
    this.previews.stop();
    clearTimeout(this.noteTimer);
    clearTimeout(this.luminanceTimer);
    this.setPreview(null);
    this.input.destroy();
    this.stage.destroy();
    this.root.remove();
  }

  private changed(isLoad: boolean): void {
    this.changedAt = performance.now();
    this.askPreview();
    this.stage.redraw();
    this.showState();
    if (!isLoad) this.options.onChange?.(this.document.entries);
  }
  private askPreview(): void {
    const { width, height } = this.stage.layers.size;
    this.previews.changed(this.document.entries, Math.min(previewSide, Math.max(width, height)));
  }
  private setPreview(bitmap: ImageBitmap | null): void {
    this.stage.layers.preview?.close();
    this.stage.layers.preview = bitmap;
    this.stage.redraw();
  }
  private showState(): void {
    const { view } = this.stage;
    this.bar.show({
      undoName: this.document.undoName,
      redoName: this.document.redoName,
      isComparing: this.store.now.isComparing,
      count: this.document.entries.length,
      scale: view.scale * this.stage.ratio,
    });
    Object.assign(this.root.dataset, {
      count: this.document.entries.length, scale: view.scale, x: view.x, y: view.y, tool: this.store.now.tool,
    });
  }
  private say(text: string): void {
    this.note.textContent = text;
    clearTimeout(this.noteTimer);
    this.noteTimer = setTimeout(() => (this.note.textContent = ''), noteTime);
  }

  private begin(sample: Sample, device: Device): boolean {
    const { fill, recent } = this.store.now;
    const tool = device === 'eraser of pen' ? 'eraser' : this.store.now.tool;
    if (tool === 'picker') {
      this.pick(sample.x, sample.y);
      return false;
    }
    const input: ActionInput = {
      document: this.document,
      size: this.stage.layers.size,
      texts: this.texts,
      settings: () => ({ ...this.store.now, tool }),
      scale: () => this.stage.view.scale,
      luminance: () => this.stage.layers.luminance,
    };
    if (this.store.now.isComparing) this.store.set({ isComparing: false });
    if (!this.store.now.layers.strokes.isShown) this.store.setLayer('strokes', { isShown: true });
    this.action = beginAction(input, sample, device === 'pen');
    if (tool !== 'eraser' && fill.color !== undefined && recent[0] !== fill.color) {
      this.store.set({ recent: withRecent(recent, fill.color, recentLimit) });
    }
    this.stage.redraw();
    if (tool !== 'region' || device !== 'keys') return true;
    this.end(); // the reach is set by its slider
    return false;
  }
  private end(): void {
    const { action } = this;
    this.action = undefined;
    const problem = action?.end();
    if (problem) this.say(problem);
    this.stage.redraw();
  }

  private hover(x: number, y: number): void {
    clearTimeout(this.luminanceTimer);
    this.luminanceTimer = setTimeout(() => {
      const luminance = this.stage.layers.luminanceAt(x, y);
      if (luminance !== undefined) this.store.set({ luminance });
    }, 120);
  }

  private pick(x: number, y: number): void {
    const fill = this.fillAt(x, y);
    if (!fill) {
      this.say(this.texts.nothingThere);
      return;
    }
    this.store.set({ fill });
    this.say(filled(this.texts.picked,
      fill.color ?? (fill.keep === 'neutral' ? this.texts.neutral : this.texts.automatic)));
  }
  private fillAt(x: number, y: number): Fill | undefined {
    const { layers } = this.stage;
    if (layers.luminanceAt(x, y) === undefined) return undefined;
    const { pickFrom, layers: shown } = this.store.now;
    const hex = (pixel: Uint8ClampedArray): Fill => ({ color: hexFromBytes(pixel[0], pixel[1], pixel[2]) });
    if (pickFrom === 'photo') return hex(layers.colorAt('photo', x, y));
    if (pickFrom === 'automatic') return layers.automatic ? hex(layers.colorAt(layers.automatic, x, y)) : undefined;
    // A stroke gives its own colour, exactly.
    const on: StrokeEntry | undefined = shown.strokes.isShown
      ? [...this.document.entries].reverse().find((entry) => covers(entry, x, y)) : undefined;
    if (on) return on.keep !== undefined ? { keep: on.keep } : { color: on.color };
    this.stage.flush();
    const [sx, sy] = this.stage.screenAt(x, y);
    const { ratio, canvas } = this.stage;
    return hex(canvas.getContext('2d')!.getImageData(Math.floor(sx * ratio), Math.floor(sy * ratio), 1, 1).data);
  }

  private command(command: KeyCommand): void {
    const { texts, store, stage } = this;
    switch (command) {
      case 'undo':
      case 'redo': {
        if (this.action) return;
        const name = command === 'undo' ? this.document.undo() : this.document.redo();
        const nothing = command === 'undo' ? texts.nothingToUndo : texts.nothingToRedo;
        this.say(name ? filled(command === 'undo' ? texts.undone : texts.redone, name) : nothing);
        return;
      }
      case 'zoomIn':
        return stage.zoom(1.25);
      case 'zoomOut':
        return stage.zoom(1 / 1.25);
      case 'fit':
        return stage.fit();
      case 'fullSize':
        return stage.zoomTo(1 / stage.ratio);
      case 'smaller':
      case 'larger': {
        const largest = largestWidth(Math.max(stage.layers.size.width, stage.layers.size.height));
        const at = sliderOfWidth(store.now.width, largest) + (command === 'larger' ? 4 : -4);
        return store.set({ width: widthOfSlider(Math.min(100, Math.max(0, at)), largest) });
      }
      case 'swap':
        return this.swap();
      case 'compare':
        return store.set({ isComparing: !store.now.isComparing });
      case 'shortcuts':
        return this.dialog.showModal();
      case 'save':
        return this.saveFile();
      case 'open':
        return this.fileInput.click();
      default:
        return store.set({ tool: command });
    }
  }

  // Back to the colour of the stroke before.
  private swap(): void {
    const { fill, recent } = this.store.now;
    const color = recent.find((one) => one !== fill.color);
    if (color) this.store.set({ fill: { color } });
  }
  private saveFile(): void {
    if (this.document.entries.length === 0) return this.say(this.texts.noStrokes);
    const url = URL.createObjectURL(new Blob([serializeStrokes(this.document.entries)], { type: 'application/json' }));
    element('a', { href: url, download: 'strokes.json' }).click();
    setTimeout(() => URL.revokeObjectURL(url), 10000);
  }
  // Replaces all strokes; can be undone.
  private async openFile(): Promise<void> {
    const file = this.fileInput.files?.[0];
    this.fileInput.value = '';
    if (!file) return;
    try {
      const strokes = parseStrokes(await file.text());
      checkInside(strokes, this.options.photo.width, this.options.photo.height);
      this.document.replaceAll(this.texts.open, strokes);
      this.say(filled(this.texts.opened, strokes.length));
    } catch (error) {
      this.say(filled(this.texts.notOpened, `${file.name}: ${(error as Error).message}`));
    }
  }
}
