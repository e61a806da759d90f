// What a stroke touches: its pull, 0..1 for each pixel, at a reach of 1 (core/method/STILL.md "Corrections").

export const leastReach = 0.1;
export const mostReach = 2;
export const visible = 0.08; // a pull below this is not seen

// The pull at another reach.
export const reached = (pull: number, reach: number): number => (pull <= 0 ? 0 : pull ** (1 / reach));

// Pulls of a picture as shares of its pixels for each of 256 values, so that the reach may change at once.
export type Histogram = readonly number[];
export const histogramOf = (values: ArrayLike<number>, step = 1): Histogram => {
  const counts = new Array<number>(256).fill(0);
  let all = 0;
  for (let i = 0; i < values.length; i += step) {
    ++counts[values[i]!];
    ++all;
  }
  return counts.map((count) => count / Math.max(1, all));
};
// Share of the picture that is visibly touched.
export const touchedShare = (histogram: Histogram, reach: number): number =>
  histogram.reduce((sum, share, value) => (reached(value / 255, reach) >= visible ? sum + share : sum), 0);

// The slider goes from 0 to 1, 1 in reach being at its middle.
export const reachOfSlider = (at: number): number =>
  at < 0.5 ? leastReach * (1 / leastReach) ** (2 * at) : mostReach ** (2 * at - 1);
export const sliderOfReach = (reach: number): number =>
  reach < 1 ? Math.log(reach / leastReach) / Math.log(1 / leastReach) / 2 : 0.5 + Math.log(reach) / Math.log(mostReach) / 2;

export const reachInWords = (reach: number): string => {
  if (reach < 0.2) return 'this thing only';
  if (reach < 0.6) return 'near and very alike';
  if (reach < 1.3) return 'what is alike';
  return 'also what is roughly alike';
};
