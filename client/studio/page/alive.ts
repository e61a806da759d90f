// Tells the studio that a page is open, and the user when it is gone.
import { problem, replace } from './dom';

const everyMs = 30_000;

export const stayAlive = (place: HTMLElement): void => {
  const look = async (): Promise<void> => {
    let isThere = false;
    try {
      isThere = (await fetch('/api/alive')).ok;
    } catch {
      // as below
    }
    if (isThere) replace(place);
    else if (!place.firstChild) {
      replace(place, problem('The studio has ended. Start Color3D Studio again from the menu, or with `color3d studio`; your scenes are kept, and what was being coloured goes on.'));
    }
    setTimeout(() => void look(), everyMs);
  };
  setTimeout(() => void look(), everyMs);
};
