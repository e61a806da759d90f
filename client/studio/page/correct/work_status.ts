// A version of the scene that is worked on: what is done, and how far it is.
import { artifactUrl, follow, type Run } from '../api';
import { bar, h } from '../dom';
import { isFinished, seconds, stageName } from '../words';

export interface WorkHooks {
  scene(run: string, page: string): void; // the scene of the version is there, before its report is
  failed(text: string): void;
  ended(succeeded: boolean): void;
}

export class WorkStatus {
  readonly root: HTMLElement;
  job: string | null = null;
  private readonly says = h('p', { role: 'status' });
  private readonly progress = bar('Working on the scene');
  private stop: (() => void) | undefined;

  constructor(private readonly hooks: WorkHooks) {
    this.progress.element.hidden = true;
    this.root = h('div', { class: 'co-status' }, this.says, this.progress.element);
  }

  follow(job: string, text: string): void {
    if (this.job === job) return;
    this.stop?.();
    this.job = job;
    this.says.textContent = text;
    this.progress.element.hidden = false;
    this.progress.set(null);
    this.stop = follow(job, {
      run: (run) => this.show(run),
      problem: (problem) => this.hooks.failed(problem),
      end: () => this.rest(job, true),
    });
  }
  destroy(): void {
    this.stop?.();
  }

  private show(run: Run): void {
    if (run.id !== this.job) return;
    const exported = run.stages.find(({ kind }) => kind === 'export');
    if (exported?.state === 'SUCCEEDED') this.hooks.scene(run.id, artifactUrl(exported.id, 'view.html'));
    const stage = run.stages.find(({ state }) => state === 'RUNNING');
    const left = run.seconds_left === null ? '' : `, about ${seconds(run.seconds_left)} for all of it`;
    if (stage) this.progress.element.setAttribute('aria-label', stageName(stage.kind) + left);
    this.progress.set(stage && stage.share > 0 ? stage.share : null);
    if (!isFinished(run.state)) return;
    if (run.state === 'FAILED') this.hooks.failed(run.stages.find(({ error }) => error)?.error ?? run.error ?? 'The change did not work.');
    this.rest(run.id, run.state === 'SUCCEEDED');
  }
  private rest(job: string, succeeded: boolean): void {
    if (this.job !== job) return;
    this.job = null;
    this.progress.element.hidden = true;
    this.says.textContent = '';
    this.hooks.ended(succeeded);
  }
}
