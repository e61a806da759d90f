// The difference between two colourings of the photos, small, for the scene in the frame.
import type { SceneView } from '../calls';
import type { Gain } from '../model/tone';
import type { Colors, PictureStore } from './picture_store';
import { pixelsOf } from './shading';
import { stripSide } from './strip';

export interface ChangeMap { readonly photo: string; readonly width: number; readonly height: number; readonly ab: Int8Array }
const maxMaps = 24;
const leastChange = 2; // Lab units; smaller ones are rounding

const limited = (value: number): number => Math.max(-127, Math.min(127, Math.round(value)));
// From pixels whose red and green are a and b; times the factors of the gain that the scene has.
export const differenceOf = (before: ArrayLike<number>, after: ArrayLike<number>, [ka, , kb]: Gain): Int8Array => {
  const ab = new Int8Array(before.length / 2);
  for (let i = 0, at = 0; i < before.length; i += 4, at += 2) {
    const a = after[i]! - before[i]!;
    const b = after[i + 1]! - before[i + 1]!;
    if (Math.hypot(a, b) < leastChange) continue;
    ab[at] = limited(ka * a);
    ab[at + 1] = limited(kb * b);
  }
  return ab;
};

const isSame = (x: Colors, y: Colors): boolean => x.run === y.run && x.trial === y.trial && x.isBase === y.isBase;
// No maps if both are the same.
export const changesBetween = async (
  store: PictureStore, views: readonly SceneView[], before: Colors, after: Colors, gain: Gain,
): Promise<ChangeMap[]> => {
  if (isSame(before, after)) return [];
  const step = Math.max(1, views.length / maxMaps);
  const chosen = views.filter((_, i) => Math.floor(i / step) !== Math.floor((i - 1) / step));
  const maps = await Promise.all(chosen.map(async ({ name }) => {
    const [from, to] = await Promise.all([before, after].map((colors) =>
      store.parts(name, stripSide, colors, { source: false, pull: false })));
    if (!from!.color || !to!.color) return null;
    const { width, height } = to!.color;
    const ab = differenceOf(pixelsOf(from!.color, width, height), pixelsOf(to!.color, width, height), gain);
    return { photo: name, width, height, ab };
  }));
  return maps.filter((map): map is ChangeMap => map !== null);
};
