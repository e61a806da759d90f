// sRGB <-> CIE Lab, D65, with the constants of core/color/lab.cc. sRGB channels are 0..1; L is 0..100.

export interface Rgb {
  readonly r: number;
  readonly g: number;
  readonly b: number;
}
export interface Lab {
  readonly l: number;
  readonly a: number;
  readonly b: number;
}

const xyzFromRgb = [
  [0.4124564, 0.3575761, 0.1804375],
  [0.2126729, 0.7151522, 0.072175],
  [0.0193339, 0.119192, 0.9503041],
] as const;
const white = xyzFromRgb.map((row) => row[0] + row[1] + row[2]) as [number, number, number];
const epsilon = 216 / 24389;
const kappa = 24389 / 27;
const delta = 6 / 29;

const inverse = (m: typeof xyzFromRgb): number[][] => {
  const determinant = [0, 1, 2].reduce(
    (sum, j) => sum + m[0][j] * (m[1][(j + 1) % 3] * m[2][(j + 2) % 3] - m[1][(j + 2) % 3] * m[2][(j + 1) % 3]), 0);
  return [0, 1, 2].map((j) => [0, 1, 2].map((i) =>
    (m[(i + 1) % 3][(j + 1) % 3] * m[(i + 2) % 3][(j + 2) % 3] -
      m[(i + 1) % 3][(j + 2) % 3] * m[(i + 2) % 3][(j + 1) % 3]) / determinant));
};
const rgbFromXyz = inverse(xyzFromRgb);

const linearOf = (v: number): number => {
  const m = Math.abs(v);
  return Math.sign(v) * (m <= 0.04045 ? m / 12.92 : ((m + 0.055) / 1.055) ** 2.4);
};
const encodedOf = (v: number): number => {
  const m = Math.abs(v);
  return Math.sign(v) * (m <= 0.0031308 ? 12.92 * m : 1.055 * m ** (1 / 2.4) - 0.055);
};
const f = (t: number): number => (t > epsilon ? Math.cbrt(t) : (kappa * t + 16) / 116);
const inverseF = (t: number): number => (t > delta ? t * t * t : (116 * t - 16) / kappa);

const linearOfByte = Float64Array.from({ length: 256 }, (_, i) => linearOf(i / 255));

const labOfLinear = (r: number, g: number, b: number): Lab => {
  const [fx, fy, fz] = xyzFromRgb.map((row, i) => f((row[0] * r + row[1] * g + row[2] * b) / white[i])) as
    [number, number, number];
  return { l: 116 * fy - 16, a: 500 * (fx - fy), b: 200 * (fy - fz) };
};

export const labFromSrgb = ({ r, g, b }: Rgb): Lab => labOfLinear(linearOf(r), linearOf(g), linearOf(b));
// Channels 0..255.
export const labFromBytes = (r: number, g: number, b: number): Lab =>
  labOfLinear(linearOfByte[r], linearOfByte[g], linearOfByte[b]);
// L of a pixel, channels 0..255.
export const luminanceFromBytes = (r: number, g: number, b: number): number =>
  116 * f((xyzFromRgb[1][0] * linearOfByte[r] + xyzFromRgb[1][1] * linearOfByte[g] +
    xyzFromRgb[1][2] * linearOfByte[b]) / white[1]) - 16;

// May lie outside 0..1.
export const srgbFromLabUnclamped = ({ l, a, b }: Lab): Rgb => {
  const fy = (l + 16) / 116;
  const xyz = [white[0] * inverseF(fy + a / 500), white[1] * inverseF(fy), white[2] * inverseF(fy - b / 200)];
  const [red, green, blue] = rgbFromXyz.map((row) => encodedOf(row[0] * xyz[0] + row[1] * xyz[1] + row[2] * xyz[2]));
  return { r: red, g: green, b: blue };
};
export const isInGamut = ({ r, g, b }: Rgb, slack = 1e-4): boolean =>
  Math.min(r, g, b) >= -slack && Math.max(r, g, b) <= 1 + slack;

// In 0..1: chroma is reduced at constant L and hue until the colour fits.
export const srgbFromLab = (lab: Lab): Rgb => {
  const l = Math.min(100, Math.max(0, lab.l));
  const at = (share: number) => srgbFromLabUnclamped({ l, a: share * lab.a, b: share * lab.b });
  let rgb = at(1);
  if (!isInGamut(rgb)) {
    let low = 0;
    let high = 1;
    for (let i = 0; i < 20; ++i) {
      const middle = (low + high) / 2;
      if (isInGamut(at(middle))) low = middle;
      else high = middle;
    }
    rgb = at(low);
  }
  const clamp = (v: number) => Math.min(1, Math.max(0, v));
  return { r: clamp(rgb.r), g: clamp(rgb.g), b: clamp(rgb.b) };
};

const byte = (v: number): number => Math.round(Math.min(1, Math.max(0, v)) * 255);
// "#rrggbb".
export const hexFromSrgb = ({ r, g, b }: Rgb): string =>
  '#' + [r, g, b].map((v) => byte(v).toString(16).padStart(2, '0')).join('');
export const hexFromBytes = (r: number, g: number, b: number): string =>
  hexFromSrgb({ r: r / 255, g: g / 255, b: b / 255 });
// Requires: "#rrggbb".
export const srgbFromHex = (hex: string): Rgb => {
  const value = parseInt(hex.slice(1), 16);
  return { r: (value >> 16) / 255, g: ((value >> 8) & 255) / 255, b: (value & 255) / 255 };
};
export const labFromHex = (hex: string): Lab => labFromSrgb(srgbFromHex(hex));
export const hexFromLab = (lab: Lab): string => hexFromSrgb(srgbFromLab(lab));

// The colour as it will look on a surface of this luminance: hue and chroma of `hex`, L of the photo.
export const hexAtLuminance = (hex: string, luminance: number): string =>
  hexFromLab({ ...labFromHex(hex), l: luminance });

export const chromaOf = ({ a, b }: Lab): number => Math.hypot(a, b);
// Degrees, 0..360.
export const hueOf = ({ a, b }: Lab): number => ((Math.atan2(b, a) * 180) / Math.PI + 360) % 360;
export const distance = (x: Lab, y: Lab): number => Math.hypot(x.l - y.l, x.a - y.a, x.b - y.b);
