// The list of colour hints as `color3d key color --hints FILE.json` takes it (core/keycolor/hints/hints.h):
// types, checks with the messages of the service, and the one way in which a list is written. Coordinates are
// px of the key photo from its upper left corner; colours are sRGB, of which only hue and chroma count.

export type Point = readonly [number, number];

export interface Disc {
  readonly x: number;
  readonly y: number;
  readonly radius?: number; // px, 2 by default
}
export interface Line {
  readonly line: readonly Point[];
  readonly width?: number; // px, 4 by default
}
// A polygon by the even-odd rule: holes and further parts hang on it by edges that are walked to and fro.
export interface Region {
  readonly region: readonly Point[];
}
// All pixels of a value of a label picture, which the painter does not have: kept, not drawn.
export interface Label {
  readonly label: number;
}
export type Keep = 'neutral' | 'auto';
export type Fill =
  | { readonly color: string; readonly keep?: undefined }
  | { readonly keep: Keep; readonly color?: undefined };
export type Shape = Disc | Line | Region | Label;
export type StrokeEntry = Shape & Fill;
export type StrokeFile = readonly StrokeEntry[];

export const defaultRadius = 2;
export const defaultWidth = 4;
export const maxEntries = 100000;
export const maxPoints = 10000;

export const isLine = (entry: Shape): entry is Line => 'line' in entry;
export const isRegion = (entry: Shape): entry is Region => 'region' in entry;
export const isLabel = (entry: Shape): entry is Label => 'label' in entry;
export const isDisc = (entry: Shape): entry is Disc => 'x' in entry;
export const halfWidth = (line: Line): number => (line.width ?? defaultWidth) / 2;

// A list that the service would refuse; the message names the entry.
export class StrokeFileError extends Error {}

const fail = (message: string): never => {
  throw new StrokeFileError(message);
};

type Fields = Record<string, unknown>;

const numberOf = (entry: Fields, field: string, name: string): number => {
  const value = entry[field];
  if (typeof value !== 'number' || !Number.isFinite(value)) fail(`${name} lacks the number "${field}"`);
  return value as number;
};
const notNegative = (value: number, name: string): number => {
  if (value < 0) fail(`${name} has a negative coordinate, radius or width`);
  return value;
};

const pointsOf = (value: unknown, name: string): Point[] => {
  const shape = 'it must look like [[10, 20], [80, 25], ...]';
  if (!Array.isArray(value) || value.length === 0 || value.length > maxPoints) {
    return fail(`${name} has no list of 1 to ${maxPoints} points; ${shape}`);
  }
  return value.map((point: unknown): Point => {
    if (!Array.isArray(point) || point.length !== 2 || !point.every((v) => Number.isFinite(v))) {
      return fail(`${name} has a point that is not a pair of numbers; ${shape}`);
    }
    return [point[0] as number, point[1] as number];
  });
};

const shapeOf = (entry: Fields, name: string): Shape => {
  if ('line' in entry) {
    const line = pointsOf(entry.line, name);
    if (!('width' in entry)) return { line };
    return { line, width: notNegative(numberOf(entry, 'width', name), name) };
  }
  if ('region' in entry) return { region: pointsOf(entry.region, name) };
  if ('label' in entry) {
    const label = numberOf(entry, 'label', name);
    if (!Number.isInteger(label) || label < 0 || label > 255) {
      fail(`${name} has a label that is not an integer from 0 to 255`);
    }
    return { label };
  }
  const x = notNegative(numberOf(entry, 'x', name), name);
  const y = notNegative(numberOf(entry, 'y', name), name);
  if (!('radius' in entry)) return { x, y };
  return { x, y, radius: notNegative(numberOf(entry, 'radius', name), name) };
};

const fillOf = (entry: Fields, name: string): Fill => {
  if ('keep' in entry) {
    if ('color' in entry) fail(`${name} has both "color" and "keep"`);
    if (entry.keep !== 'neutral' && entry.keep !== 'auto') {
      fail(`${name} has a "keep" that is neither "neutral" nor "auto"`);
    }
    return { keep: entry.keep as Keep };
  }
  if (typeof entry.color !== 'string') return fail(`${name} lacks the text "color", such as "#a0522d"`);
  if (!/^#[0-9a-f]{6}$/i.test(entry.color)) {
    fail(`${name} has the color "${entry.color.slice(0, 32)}"; it must look like "#a0522d"`);
  }
  return { color: entry.color.toLowerCase() };
};

const knownFields = (entry: Fields): string[] => {
  if ('line' in entry) return ['line', 'width', 'color', 'keep'];
  if ('region' in entry) return ['region', 'color', 'keep'];
  if ('label' in entry) return ['label', 'color', 'keep'];
  return ['x', 'y', 'radius', 'color', 'keep'];
};

// Returns the list that `value` is, with its colours in small letters. Throws StrokeFileError.
export const checkStrokes = (value: unknown): StrokeEntry[] => {
  if (!Array.isArray(value) || value.length > maxEntries) {
    return fail(`the colour hints must be a JSON list of at most ${maxEntries} entries`);
  }
  return value.map((item: unknown, index): StrokeEntry => {
    const name = `colour hint ${index}`;
    if (typeof item !== 'object' || item === null || Array.isArray(item)) fail(`${name} is not an object`);
    const entry = item as Fields;
    const known = knownFields(entry);
    for (const field of Object.keys(entry)) {
      if (known.includes(field)) continue;
      fail(`${name} has an unknown field "${field.slice(0, 32)}"; known for this shape are ${known.join(', ')}`);
    }
    return { ...shapeOf(entry, name), ...fillOf(entry, name) };
  });
};

// Throws StrokeFileError if an entry lies outside a photo of this size.
export const checkInside = (strokes: StrokeFile, width: number, height: number): void => {
  strokes.forEach((entry, index) => {
    const complain = (x: number, y: number) =>
      fail(`colour hint ${index} at (${x}, ${y}) lies outside the photo of ${width}x${height} px`);
    if (isDisc(entry) && (entry.x >= width || entry.y >= height)) complain(entry.x, entry.y);
    const points = isLine(entry) ? entry.line : isRegion(entry) ? entry.region : [];
    for (const [x, y] of points) {
      if (x < 0 || x > width || y < 0 || y > height) complain(x, y);
    }
    if (isRegion(entry) && points.length < 3) {
      fail(`colour hint ${index} is a region of ${points.length} points, but needs at least 3`);
    }
  });
};

// Throws StrokeFileError, also where `text` is not JSON.
export const parseStrokes = (text: string): StrokeEntry[] => {
  let value: unknown;
  try {
    value = JSON.parse(text);
  } catch (error) {
    return fail(`the colour hints are not JSON: ${(error as Error).message}`);
  }
  return checkStrokes(value);
};

const number = (value: number): string => JSON.stringify(value);
const points = (list: readonly Point[]): string =>
  '[' + list.map(([x, y]) => `[${number(x)}, ${number(y)}]`).join(', ') + ']';

const serializeShape = (entry: Shape): string => {
  if (isLine(entry)) return `"line": ${points(entry.line)}, "width": ${number(entry.width ?? defaultWidth)}`;
  if (isRegion(entry)) return `"region": ${points(entry.region)}`;
  if (isLabel(entry)) return `"label": ${number(entry.label)}`;
  return `"x": ${number(entry.x)}, "y": ${number(entry.y)}, "radius": ${number(entry.radius ?? defaultRadius)}`;
};
const serializeFill = (entry: Fill): string =>
  entry.keep !== undefined ? `"keep": "${entry.keep}"` : `"color": "${entry.color.toLowerCase()}"`;

// The one text of a list: an entry a line, shape before fill, defaults written out, shortest numbers that read
// back the same. Equal lists give equal bytes.
export const serializeStrokes = (strokes: StrokeFile): string => {
  if (strokes.length === 0) return '[]\n';
  return '[\n' + strokes.map((entry) => `{${serializeShape(entry)}, ${serializeFill(entry)}}`).join(',\n') + '\n]\n';
};
