// Saturation and white balance of a whole scene, as core/splat/chroma/chroma_adjustment.cc computes them:
// a' = ka a + pa (L + 16), b' = kb b + pb (L + 16), in Lab.
import type { Lab } from '../../paint/color/lab';

export interface Tone {
  readonly saturation: number; // factor, 0..4
  readonly tint: number; // a of a grey of L 50, -50..50
  readonly warmth: number; // b of the same
}
export type Gain = readonly [ka: number, pa: number, kb: number, pb: number];

export const plainTone: Tone = { saturation: 1, tint: 0, warmth: 0 };
export const plainGain: Gain = [1, 0, 1, 0];
const perL = 50 + 16;
const largest = 50;
const leastFactor = 0.02; // smaller ones cannot be undone

export const gainOf = ({ saturation, tint, warmth }: Tone): Gain => {
  const pa = tint / perL;
  const pb = warmth / perL;
  return [saturation * (1 + (pa * 116) / 500), pa, saturation * (1 - (pb * 116) / 200), pb];
};

const ratio = (k1: number, p1: number, k2: number, p2: number): [number, number] => {
  const k = k1 < leastFactor ? 0 : k2 / k1;
  return [k, p2 - k * p1];
};
// What colours of tone `before` need to become those of tone `after`.
export const gainBetween = (before: Tone, after: Tone): Gain => {
  const [ka1, pa1, kb1, pb1] = gainOf(before);
  const [ka2, pa2, kb2, pb2] = gainOf(after);
  return [...ratio(ka1, pa1, ka2, pa2), ...ratio(kb1, pb1, kb2, pb2)];
};

export const toned = ({ l, a, b }: Lab, [ka, pa, kb, pb]: Gain): Lab =>
  ({ l, a: ka * a + pa * (l + 16), b: kb * b + pb * (l + 16) });

const limited = (value: number): number => Math.min(largest, Math.max(-largest, value));
// The tone in which a colour (without a tone) becomes grey, at this saturation.
export const neutralized = ({ l, a, b }: Lab, { saturation }: Tone): Tone => {
  const share = (value: number, slope: number): number => {
    const below = l + 16 + slope * saturation * value;
    return below > 1 ? (-saturation * value) / below : -Math.sign(value);
  };
  return {
    saturation,
    tint: limited(perL * share(a, 116 / 500)),
    warmth: limited(perL * share(b, -116 / 200)),
  };
};

export const sameTone = (x: Tone, y: Tone): boolean =>
  Math.abs(x.saturation - y.saturation) < 1e-6 && Math.abs(x.tint - y.tint) < 1e-6 &&
  Math.abs(x.warmth - y.warmth) < 1e-6;
