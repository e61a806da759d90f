// What the tools do between the pointer's down and up, in px of the photo.
import type { StrokeDocument } from '../model/document';
import type { Point, StrokeEntry } from '../model/stroke_file';
import { polygonsOfMask } from '../raster/contour';
import { erased } from '../raster/erase';
import { maskOf, isEmpty, type Size } from '../raster/mask';
import type { Luminance } from '../region/edge_weights';
import { regionWithin, resistanceFrom } from '../region/grow';
import type { Texts } from '../texts';
import { entriesOfPath, linesOfEraser, snapped, type Sample } from './path';
import { resistanceOfReach, type Settings } from './settings';

export interface ActionInput {
  readonly document: StrokeDocument;
  readonly size: Size; // of the photo
  readonly texts: Texts;
  settings(): Settings;
  scale(): number; // of the view
  luminance(): Luminance;
}
// One use of a tool. `entries` and `eraser` are shown meanwhile.
export interface Action {
  readonly entries: readonly StrokeEntry[];
  readonly eraser: ReturnType<typeof linesOfEraser>;
  extend(samples: readonly Sample[], holdsAngle: boolean): void;
  // Returns what went wrong, for the user.
  end(): string | undefined;
}

const paths = (input: ActionInput, samples: Sample[], name: string, isPen: boolean): Action => {
  const { fill, width, withPressure } = input.settings();
  const entries = () => entriesOfPath(
    samples,
    { width, withPressure: withPressure && isPen, fill, tolerance: Math.min(2, 0.4 / input.scale()) },
    input.size);
  return {
    get entries() {
      return entries();
    },
    eraser: [],
    extend: (more) => void samples.push(...more),
    end: () => {
      input.document.add(name, entries());
      return undefined;
    },
  };
};

const straight = (input: ActionInput, first: Sample): Action => {
  const { fill, width } = input.settings();
  let last = first;
  const entries = () =>
    entriesOfPath(last === first ? [first] : [first, last], { width, withPressure: false, fill, tolerance: 0 },
      input.size);
  return {
    get entries() {
      return entries();
    },
    eraser: [],
    extend: (more, holdsAngle) => {
      last = holdsAngle ? snapped(first, more.at(-1)!) : more.at(-1)!;
    },
    end: () => {
      input.document.add(input.texts.line, entries());
      return undefined;
    },
  };
};

const eraser = (input: ActionInput, samples: Sample[]): Action => {
  const { width } = input.settings();
  return {
    entries: [],
    get eraser() {
      return linesOfEraser(samples, width, input.size);
    },
    extend: (more) => void samples.push(...more),
    end: () => {
      const { document, size } = input;
      document.replaceAll(
        input.texts.eraser, erased(document.entries, linesOfEraser(samples, width, size), size));
      return undefined;
    },
  };
};

const tolerance = 0.75; // px of the reduced photo that a region's border may move
const leastArea = 40; // px of the reduced photo
const reachPerPx = 0.25;

// Grows from the first place; the way to the right or left sets how far.
const region = (input: ActionInput, first: Sample): Action => {
  const { fill, reach } = input.settings();
  const { size } = input;
  const luminance = input.luminance();
  const isInside = first.x >= 0 && first.y >= 0 && first.x < size.width && first.y < size.height;
  const sx = size.width / luminance.width, sy = size.height / luminance.height;
  let known = 0; // reach up to which the distances are
  let distances: Float32Array | undefined;
  const far = (needed: number): Float32Array => {
    if (distances && needed <= known) return distances;
    known = Math.min(100, needed + 10);
    return (distances = resistanceFrom(
      luminance, Math.floor(first.x / sx), Math.floor(first.y / sy), resistanceOfReach(known)));
  };
  let wanted = reach;
  let grown: { reach: number; entries: StrokeEntry[] } | undefined;
  const entries = (): StrokeEntry[] => {
    if (!isInside) return [];
    if (grown?.reach === wanted) return grown.entries;
    const mask = regionWithin(far(wanted), luminance.width, luminance.height, resistanceOfReach(wanted));
    const rounded = (v: number, side: number) => Math.min(side, Math.round(v * 10) / 10);
    const made = polygonsOfMask(mask, tolerance, leastArea)
      .map((polygon): StrokeEntry => ({
        region: polygon.map(([x, y]): Point => [rounded(x * sx, size.width), rounded(y * sy, size.height)]),
        ...fill,
      }));
    grown = { reach: wanted, entries: made };
    return made;
  };
  return {
    get entries() {
      return entries();
    },
    eraser: [],
    extend: (more) => {
      const moved = (more.at(-1)!.x - first.x) * input.scale();
      wanted = Math.round(Math.min(100, Math.max(1, reach + reachPerPx * moved)));
    },
    end: () => {
      if (!isInside) return input.texts.nothingThere;
      // Each entry of the format must cover a pixel.
      const made = entries().filter((entry) => !isEmpty(maskOf(entry, size)));
      input.document.add(input.texts.region, made);
      return made.length ? undefined : input.texts.nothingGrown;
    },
  };
};

// The action of the tool that is set, except the picker, which is no action.
export const beginAction = (input: ActionInput, first: Sample, isPen: boolean): Action => {
  switch (input.settings().tool) {
    case 'line':
      return straight(input, first);
    case 'region':
      return region(input, first);
    case 'eraser':
      return eraser(input, [first]);
    default:
      return paths(input, [first], input.texts.brush, isPen);
  }
};
