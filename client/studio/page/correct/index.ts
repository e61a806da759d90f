// A finished scene: looked at, and its colours corrected (README.md).
import { artifactUrl } from '../api';
import { replace } from '../dom';
import { describe } from './calls';
import { Corrector } from './corrector';
import { useStyle } from './style';

// Shows the scene of a finished run in `host`, and lets the user correct it. `onVersion` is told when a newer version
// of it is shown, and again when its run has ended, which has all its files then. Returns how to stop. `fail`: why corrections are not possible.
export const mountCorrector = (
  host: HTMLElement, run: string, onVersion: (run: string) => void, fail: (reason: string) => void,
): (() => void) => {
  let corrector: Corrector | undefined;
  let isOver = false;
  useStyle();
  describe(run).then((version) => {
    if (isOver) return;
    corrector = new Corrector(run, version, onVersion);
    replace(host, corrector.root);
    corrector.loadScene(artifactUrl(run, 'view.html'));
  }).catch((error: unknown) => fail((error as Error).message));
  return () => {
    isOver = true;
    corrector?.destroy();
  };
};
