// Palettes: of a reference picture, or from a list of colours. The same input gives the same palette.
import { chromaOf, distance, hexFromLab, hueOf, labFromBytes, type Lab } from './lab';

const sampleLimit = 20000; // pixels
const leastDifference = 5; // Lab units between two colours of a palette
const refinements = 8;

interface Box {
  readonly samples: Lab[];
  readonly axis: 'l' | 'a' | 'b';
  readonly spread: number; // variance along the axis, times the number of samples
}

const boxOf = (samples: Lab[]): Box => {
  let best: Box = { samples, axis: 'l', spread: -1 };
  for (const axis of ['l', 'a', 'b'] as const) {
    const mean = samples.reduce((sum, s) => sum + s[axis], 0) / samples.length;
    // Lightness counts less: two colours of a palette should differ in hue or chroma.
    const weight = axis === 'l' ? 0.25 : 1;
    const spread = weight * samples.reduce((sum, s) => sum + (s[axis] - mean) ** 2, 0);
    if (spread > best.spread) best = { samples, axis, spread };
  }
  return best;
};
const meanOf = (samples: readonly Lab[]): Lab => {
  const sum = samples.reduce((s, x) => ({ l: s.l + x.l, a: s.a + x.a, b: s.b + x.b }), { l: 0, a: 0, b: 0 });
  return { l: sum.l / samples.length, a: sum.a / samples.length, b: sum.b / samples.length };
};

const medianCut = (samples: Lab[], count: number): Lab[] => {
  const boxes = [boxOf(samples)];
  while (boxes.length < count) {
    boxes.sort((x, y) => y.spread - x.spread);
    const { samples: widest, axis, spread } = boxes[0];
    if (spread <= 1e-6 || widest.length < 2) break;
    widest.sort((x, y) => x[axis] - y[axis]);
    const middle = widest.length >> 1;
    boxes.splice(0, 1, boxOf(widest.slice(0, middle)), boxOf(widest.slice(middle)));
  }
  return boxes.map((box) => meanOf(box.samples));
};

// k-means from these centres.
const refined = (samples: readonly Lab[], centers: Lab[]): Lab[] => {
  let current = centers;
  for (let round = 0; round < refinements; ++round) {
    const members: Lab[][] = current.map(() => []);
    for (const sample of samples) {
      let nearest = 0;
      for (let i = 1; i < current.length; ++i) {
        if (distance(sample, current[i]) < distance(sample, current[nearest])) nearest = i;
      }
      members[nearest].push(sample);
    }
    current = current.map((center, i) => (members[i].length ? meanOf(members[i]) : center));
  }
  return current;
};

// Greys first, from dark to light, then by hue.
const inOrder = (colors: Lab[]): Lab[] => {
  const isGray = (c: Lab) => chromaOf(c) < 6;
  return [...colors].sort((x, y) => {
    if (isGray(x) !== isGray(y)) return isGray(x) ? -1 : 1;
    return isGray(x) ? x.l - y.l : hueOf(x) - hueOf(y) || x.l - y.l;
  });
};

// At most `count` colours ("#rrggbb") of RGBA pixels; transparent ones do not count.
export const paletteOfPicture = (rgba: Uint8ClampedArray | Uint8Array, count: number): string[] => {
  const pixels = rgba.length / 4;
  const step = Math.max(1, Math.floor(pixels / sampleLimit));
  const samples: Lab[] = [];
  for (let i = 0; i < pixels; i += step) {
    if (rgba[4 * i + 3] < 128) continue;
    samples.push(labFromBytes(rgba[4 * i], rgba[4 * i + 1], rgba[4 * i + 2]));
  }
  if (samples.length === 0) return [];
  const kept: Lab[] = [];
  for (const color of refined(samples, medianCut([...samples], count))) {
    if (kept.every((other) => distance(other, color) >= leastDifference)) kept.push(color);
  }
  return inOrder(kept).map(hexFromLab);
};

export interface ColorList {
  readonly colors: string[]; // "#rrggbb", each once, in the order of the text
  readonly rejected: string[]; // words that are no colours
}

// Reads "#a0522d, #FFF 00ff00", separated by anything but letters, digits and #.
export const colorsOfText = (text: string): ColorList => {
  const colors: string[] = [];
  const rejected: string[] = [];
  for (const word of text.split(/[^#0-9a-z]+/i).filter(Boolean)) {
    const digits = word.replace(/^#/, '').toLowerCase();
    if (!/^([0-9a-f]{3}|[0-9a-f]{6})$/.test(digits)) {
      rejected.push(word);
      continue;
    }
    const hex = '#' + (digits.length === 3 ? [...digits].map((d) => d + d).join('') : digits);
    if (!colors.includes(hex)) colors.push(hex);
  }
  return { colors, rejected };
};

// The colours used last, newest first.
export const withRecent = (recent: readonly string[], color: string, limit: number): string[] =>
  [color, ...recent.filter((other) => other !== color)].slice(0, limit);
