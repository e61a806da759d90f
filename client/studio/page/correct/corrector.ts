// One scene on its page: photos, scene, brush, tone and corrections together.
import { artifactUrl } from '../api';
import { h, problem, replace, say } from '../dom';
import { labFromBytes } from '../paint/color/lab';
import { applyChange, describe, followVersions, type Change, type Correction, type SceneView, type Version, type VersionState } from './calls';
import { Draft, tried } from './draft';
import { strokeOf, type Stroke } from './model/strokes';
import { gainBetween, gainOf, neutralized, plainTone, sameTone, type Tone } from './model/tone';
import { BrushPanel } from './panel/brush_panel';
import { oneOf } from './panel/controls';
import { HistoryPanel } from './panel/history_panel';
import { Legend } from './panel/legend';
import { SideBySide } from './panel/side_by_side';
import { TonePanel } from './panel/tone_panel';
import { Touched } from './touched';
import { changesBetween } from './view/changes';
import { Picture, type PictureHooks } from './view/picture';
import { PictureStore, type Colors } from './view/picture_store';
import { cropOf, sampleAt } from './view/sample';
import { SceneFrame } from './view/scene_frame';
import { shade, Shader, type Look, type Mode, type Parts } from './view/shading';
import { Strip, stripSide } from './view/strip';
import { WorkStatus } from './work_status';

const mainSide = 1200; // px
const maxHeated = 40; // photos whose pull is fetched at once
const narrow = 1100; // px: below it the grey photo is left out at first

export class Corrector {
  readonly root = h('div', { class: 'co', id: 'corrector' });
  private readonly shader = new Shader();
  private readonly store: PictureStore;
  private readonly draft = new Draft(() => this.onDraft(), (text) => this.complain(text));
  private readonly touched = new Touched();
  private readonly brush: BrushPanel;
  private readonly tones: TonePanel;
  private readonly history: HistoryPanel;
  private readonly strip: Strip;
  private readonly scene: SceneFrame;
  private readonly photoPicture: Picture;
  private readonly colorPicture: Picture;
  private readonly modes;
  private readonly moments;
  private readonly panes: SideBySide;
  private readonly legend = new Legend();
  private readonly work: WorkStatus;
  private readonly trouble = h('div', {});
  private readonly stops: (() => void)[] = [];
  private view: SceneView;
  private mode: Mode = 'color';
  private moment: 'before' | 'after' = 'after';
  private tone: Tone;
  private ownTone: Tone | null = null; // asked for and not solved yet
  private readonly scenes = new Map<string, { run: string; tone: Tone }>(); // by address
  private sceneColors = ''; // what the scene was told
  private applied = ''; // a trial that is being applied
  private readonly removed = new Set<string>(); // corrections that are being removed
  private without: Colors | null = null;
  private asked = 0; // number of the newest request for pictures
  private frame = 0;
  private recolored = 0; // times
  private sceneUrl = '';
  private isOver = false;

  constructor(private run: string, private version: Version, private readonly onVersion: (run: string) => void) {
    this.store = new PictureStore(run, this.shader);
    this.view = version.views.find(({ name }) => name === version.key) ?? version.views[0]!;
    this.tone = version.tone;
    const hooks: PictureHooks = {
      stroke: (path) => this.stroke(strokeOf(path, this.brush.width, this.brush.fill, this.view)),
      point: (tool, x, y) => void this.point(tool, x, y),
    };
    this.photoPicture = new Picture('Photo', this.shader, hooks);
    this.colorPicture = new Picture('Coloured photo', this.shader, hooks);
    this.scene = new SceneFrame({
      ready: (url) => this.onScene(url),
      picked: ({ photo, x, y }) => this.picked(photo, x, y),
      recolored: () => { this.root.dataset.recolored = String(++this.recolored); },
      held: (photo) => { if (photo && photo !== this.view.name) this.choose(photo, false); },
    });
    this.strip = new Strip(version.views, version.key, this.shader, {
      choose: (view) => this.choose(view, true), seen: (view) => void this.fillCell(view),
    });
    this.modes = oneOf<Mode>('Show', [['color', 'Colours'], ['source', 'Where from'], ['pull', 'What it touches']], (mode) => this.setMode(mode));
    this.moments = oneOf<'before' | 'after'>('Corrections', [['before', 'Before'], ['after', 'After']], (moment) => {
      this.moment = moment;
      this.moments.set(moment);
      this.refresh();
    });
    this.brush = new BrushPanel(this.view.width, {
      changed: () => this.onBrush(),
      reach: (reach) => { this.draft.reach = reach; this.redraw(); this.showDraft(); },
      reached: (reach) => { this.draft.reach = reach; if (!this.draft.isEmpty) void this.draft.try(this.run); },
      apply: () => void this.apply(),
      discard: () => this.draft.clear(),
    });
    this.tones = new TonePanel({
      input: (tone) => { this.tone = tone; this.redraw(); },
      release: (tone) => this.askTone(tone),
      askGray: (on) => this.brush.setTool(on ? 'gray' : 'brush'),
    });
    this.history = new HistoryPanel({
      remove: (id) => void this.remove(id),
      without: (id) => void this.showWithout(id),
      draw: (correction, before, after) => void this.drawPlace(correction, before, after),
    });
    this.work = new WorkStatus({
      scene: (one, page) => void this.switchTo(one, page),
      failed: (text) => this.complain(text),
      ended: (succeeded) => this.onRest(succeeded),
    });
    this.panes = new SideBySide({
      photo: this.photoPicture.root, color: this.colorPicture.root,
      scene: h('div', { class: 'co-pane-scene' }, this.scene.root, h('p', {}, 'Scene')),
    });
    this.lay();
    this.update(version);
    this.stops.push(followVersions(run, (state) => this.onVersions(state), (text) => this.complain(text)));
  }

  loadScene(url: string): void {
    this.scenes.set(url, { run: this.run, tone: this.version.tone });
    this.scene.load(url);
  }
  destroy(): void {
    this.isOver = true;
    for (const stop of this.stops) stop();
    cancelAnimationFrame(this.frame);
    this.draft.clear();
    for (const part of [this.work, this.store, this.strip, this.photoPicture, this.colorPicture, this.scene]) part.destroy();
  }

  private lay(): void {
    this.root.addEventListener('keydown', (event) => this.undoByKey(event));
    this.root.append(
      h('div', { class: 'co-bar' }, this.panes.buttons, this.modes.root, this.moments.root),
      h('div', { class: 'co-main' },
        this.panes.root, this.legend.root, this.strip.root,
        this.work.root, this.trouble),
      h('div', { class: 'co-side' }, this.brush.root, this.tones.root, this.history.root));
    if (innerWidth < narrow) this.panes.toggle('photo');
    this.modes.set(this.mode);
    this.moments.set(this.moment);
    this.modes.enable('source', this.version.has_sources);
    this.modes.enable('pull', false);
  }

  // ---- what is shown
  private get look(): Look {
    return { mode: this.mode, gain: gainOf(this.tone), reach: this.draft.reach };
  }
  private get colors(): Colors {
    if (this.moment === 'before') return { run: this.run, trial: '', isBase: true };
    if (this.without) return this.without;
    return { run: this.run, trial: this.draft.trial || this.applied, isBase: false };
  }
  private parts(view: string, side: number): Promise<Parts> {
    return this.store.parts(view, side, this.colors, { source: this.mode === 'source', pull: this.draft.trial !== '' });
  }
  // Fetches what is to be seen, and draws it.
  private refresh(): void {
    void this.fillMain();
    for (const { name } of this.version.views) if (this.strip.isSeen(name)) void this.fillCell(name);
    this.redraw();
    void this.recolor();
  }
  // Gives the scene the colours of the photos, as far as its own differ.
  private async recolor(): Promise<void> {
    const scene = this.scenes.get(this.sceneUrl);
    if (!scene) return;
    const own: Colors = { run: scene.run, trial: '', isBase: false };
    const wanted = JSON.stringify(this.colors);
    if (wanted === (this.sceneColors || JSON.stringify(own))) return;
    this.sceneColors = wanted;
    try {
      const maps = await changesBetween(this.store, this.version.views, own, this.colors, gainOf(scene.tone));
      if (!this.isOver && wanted === this.sceneColors) this.scene.recolor(maps);
    } catch { /* The scene itself follows. */ }
  }
  private async fillMain(): Promise<void> {
    const number = ++this.asked;
    const view = this.view;
    try {
      const parts = await this.parts(view.name, mainSide);
      if (this.isOver || number !== this.asked) return;
      this.photoPicture.show(view, parts, { ...this.look, mode: 'photo' });
      this.colorPicture.show(view, parts, this.look);
      this.showStrokes();
      this.root.dataset.shown = view.name;
    } catch (error) {
      this.complain((error as Error).message, error);
    }
  }
  private async fillCell(view: string): Promise<void> {
    try {
      const parts = await this.parts(view, stripSide);
      if (this.isOver) return;
      if (parts.pull && !this.touched.has(view)) {
        this.touched.set(view, parts.pull);
        this.showDraft();
      }
      this.strip.setParts(view, parts, this.look);
    } catch (error) {
      this.complain((error as Error).message, error);
    }
  }
  // Draws all again, at the next frame.
  private redraw(): void {
    cancelAnimationFrame(this.frame);
    this.frame = requestAnimationFrame(() => {
      this.colorPicture.setLook(this.look);
      this.strip.setLook(this.look);
      this.tellScene();
    });
  }
  private tellScene(photo?: string): void {
    const baked = this.scenes.get(this.sceneUrl)?.tone ?? plainTone;
    this.scene.show({ bare: true, shades: this.mode === 'source' ? 2 : 0, tone: gainBetween(baked, this.tone), ...(photo && { photo }) });
  }
  private onScene(url: string): void {
    this.sceneUrl = url;
    this.sceneColors = '';
    this.root.dataset.scene = url;
    this.tellScene(this.view.name);
    void this.recolor();
  }

  private choose(view: string, inScene: boolean): void {
    const found = this.version.views.find(({ name }) => name === view);
    if (!found) return;
    this.view = found;
    this.strip.choose(view);
    if (inScene) this.tellScene(view);
    void this.fillMain();
    say(view);
  }
  private setMode(mode: Mode): void {
    this.mode = mode;
    this.modes.set(mode);
    this.legend.show(mode);
    this.refresh();
  }

  // ---- a stroke
  private onBrush(): void {
    if (!this.brush) return; // while it is built
    for (const picture of [this.photoPicture, this.colorPicture]) {
      picture.setTool(this.brush.tool, { width: this.brush.width, color: this.brush.shownColor });
    }
    if (this.brush.tool !== 'gray') this.tones?.root.querySelector('#co-gray')?.setAttribute('aria-pressed', 'false');
  }
  private stroke(stroke: Stroke): void {
    if (this.view.held_out) return this.complain('This photo measures how good the colours are, so it takes no strokes; draw on another one.');
    replace(this.trouble);
    this.history.setWithout(null);
    this.brush.remember();
    this.touched.clear();
    this.draft.add(this.view.name, stroke);
    void this.draft.try(this.run);
  }
  private onDraft(): void {
    if (this.isOver) return;
    this.showStrokes();
    this.modes.enable('pull', this.draft.trial !== '');
    this.touched.clear();
    for (const { name } of this.version.views) this.strip.setNote(name, '');
    this.store.keep([this.run], [this.draft.trial, this.applied, this.without?.trial ?? ''].filter(Boolean));
    this.root.dataset.trial = this.draft.trial;
    if (this.draft.trial) {
      this.setMode('pull');
      const step = Math.max(1, this.version.views.length / maxHeated);
      for (let i = 0; Math.floor(i) < this.version.views.length; i += step) void this.fillCell(this.version.views[Math.floor(i)]!.name);
    } else if (this.mode === 'pull') {
      this.setMode('color');
    }
    this.showDraft();
  }
  private undoByKey(event: KeyboardEvent): void {
    if (event.key !== 'z' || !(event.ctrlKey || event.metaKey) || event.shiftKey) return;
    event.preventDefault();
    const last = this.version.corrections.filter(({ id }) => !this.removed.has(id)).at(-1);
    if (!this.draft.isEmpty) this.draft.undo(this.run);
    else if (last && !this.applied) void this.remove(last.id);
  }
  private showStrokes(): void {
    const strokes = this.draft.view === this.view.name ? this.draft.strokes : [];
    for (const picture of [this.photoPicture, this.colorPicture]) picture.setStrokes(this.mode === 'color' && this.draft.trial ? [] : strokes);
  }
  private showDraft(): void {
    const { isEmpty, trial, reach } = this.draft;
    this.brush.showDraft(isEmpty ? null : trial ? this.touched.text(reach, Math.min(maxHeated, this.version.views.length)) : 'Looking at what it touches …', reach, trial !== '');
    if (!trial) return;
    for (const { name } of this.version.views) {
      const share = this.touched.share(name, reach);
      if (share !== null) this.strip.setNote(name, share < 0.005 ? '' : `${Math.max(1, Math.round(100 * share))} %`);
    }
  }
  private picked(photo: string, x: number, y: number): void {
    this.choose(photo, false);
    const at: [number, number] = [x * this.view.width, y * this.view.height];
    if (this.view.name !== photo) return;
    if (this.brush.tool === 'brush') this.stroke(strokeOf([at], this.brush.width, this.brush.fill, this.view));
    else void this.point(this.brush.tool, ...at);
  }
  private async point(tool: 'gray' | 'pick', x: number, y: number): Promise<void> {
    const parts = await this.parts(this.view.name, mainSide);
    const sample = sampleAt(parts, this.view, x, y, Math.max(3, this.brush.width / 4));
    if (!sample) return;
    const { gray, color } = sample;
    if (tool === 'pick') {
      const rgb = shade(gray, color, null, 0, { ...this.look, mode: 'color' });
      this.brush.setTool('brush');
      this.brush.take({ color: '#' + rgb.map((v) => Math.round(255 * v).toString(16).padStart(2, '0')).join('') });
      return;
    }
    const tone = neutralized({ l: labFromBytes(gray, gray, gray).l, a: color[0] - 128, b: color[1] - 128 }, this.tone);
    this.tones.ask(false);
    this.tones.set(tone);
    this.tone = tone;
    this.redraw();
    this.askTone(tone);
  }

  // ---- changes
  private async apply(): Promise<void> {
    const { asNew, trial } = this.draft;
    this.applied = trial;
    this.draft.clear();
    if (!await this.change({ add: asNew }, 'All photos have the new colours. The scene follows …')) this.draft.restore(asNew, trial);
  }
  private async remove(id: string): Promise<void> {
    this.removed.add(id);
    if (!await this.change({ remove: [id] }, 'Removing the correction …')) this.removed.delete(id);
  }
  private askTone(tone: Tone): void {
    if (sameTone(tone, this.ownTone ?? this.version.tone)) return;
    this.ownTone = tone;
    void this.change({ tone }, 'The scene gets these colours …');
  }
  private async change(change: Change, text: string): Promise<boolean> {
    replace(this.trouble);
    this.history.setWithout(null);
    try {
      const job = await applyChange(this.run, change);
      this.follow(job.id, text);
      return true;
    } catch (error) {
      this.applied = '';
      this.ownTone = null;
      this.complain((error as Error).message, error);
      return false;
    }
  }
  private onVersions({ newest, working }: VersionState): void {
    if (this.isOver) return;
    if (working) this.follow(working, 'The scene is being changed …');
    else if (newest && newest !== this.run) void this.switchTo(newest);
  }
  private follow(job: string, text: string): void {
    this.work.follow(job, text);
    this.root.dataset.working = job;
  }
  private onRest(succeeded: boolean): void {
    delete this.root.dataset.working;
    this.removed.clear();
    if (succeeded) return this.onVersion(this.run);
    this.applied = '';
    this.ownTone = null;
    this.refresh();
  }
  // Shows another version of the scene. `page`: of its scene; otherwise that of the run.
  private async switchTo(run: string, page = artifactUrl(run, 'view.html')): Promise<void> {
    if (run === this.run) return;
    const before = this.run;
    this.run = run;
    try {
      const version = await describe(run);
      if (this.isOver || this.run !== run) return;
      this.update(version);
    } catch (error) {
      this.run = before;
      this.complain((error as Error).message, error);
      return;
    }
    this.loadScene(page);
    this.onVersion(run);
  }
  private update(version: Version): void {
    this.version = version;
    if (this.ownTone && sameTone(this.ownTone, version.tone)) this.ownTone = null;
    if (!this.ownTone && !this.tones.isInUse) {
      this.tone = version.tone;
      this.tones.set(version.tone);
    }
    this.applied = '';
    this.without = null;
    this.root.dataset.run = this.run;
    this.root.dataset.corrections = String(version.corrections.length);
    this.moments.enable('before', version.corrections.length > 0);
    if (version.corrections.length === 0 && this.moment === 'before') {
      this.moment = 'after';
      this.moments.set('after');
    }
    this.history.show(version.corrections);
    this.strip.choose(this.view.name);
    this.onBrush();
    this.refresh();
    this.store.keep([this.run], [this.draft.trial]);
    if (!this.draft.isEmpty) void this.draft.try(this.run); // on top of what came
  }

  private async showWithout(id: string | null): Promise<void> {
    this.without = null;
    if (id !== null) {
      const isOnly = this.version.corrections.length === 1;
      try {
        const trial = isOnly ? '' : await tried(this.run, { remove: [id] }, () => !this.isOver);
        if (trial === null) return;
        this.without = { run: this.run, trial, isBase: isOnly };
      } catch (error) {
        this.complain((error as Error).message, error);
      }
      if (this.mode === 'pull') this.setMode('color');
      const view = this.version.corrections.find((one) => one.id === id)?.view;
      if (view) this.choose(view, true);
    }
    this.root.dataset.without = this.without ? id ?? '' : '';
    this.refresh();
  }
  private async drawPlace(correction: Correction, before: HTMLCanvasElement, after: HTMLCanvasElement): Promise<void> {
    const view = this.version.views.find(({ name }) => name === correction.view);
    if (!view || !correction.strokes) return;
    const crop = cropOf(correction.strokes, view);
    const look: Look = { mode: 'color', gain: gainOf(this.version.tone), reach: 1 };
    try {
      for (const [canvas, isBase] of [[before, true], [after, false]] as const) {
        const parts = await this.store.parts(view.name, mainSide, { run: this.run, trial: '', isBase }, { source: false, pull: false });
        if (this.isOver) return;
        this.shader.draw(canvas.getContext('2d')!, parts, look, crop);
      }
    } catch { /* A small picture is not worth a message; the photo itself tells what is wrong. */ }
  }

  private complain(text: string, error?: unknown): void {
    if (this.isOver || (error instanceof DOMException && error.name === 'AbortError')) return;
    replace(this.trouble, problem(text));
    if (!this.draft.isEmpty && !this.draft.trial) this.brush.showDraft(null, this.draft.reach, false);
  }
}
