// What corrections are called in the list. Pure functions.
import { chromaOf, hueOf, labFromHex } from '../../paint/color/lab';
import type { Stroke } from './strokes';

const hues: [number, string][] = [
  [20, 'pink'], [48, 'red'], [72, 'orange'], [104, 'yellow'], [125, 'olive green'], [165, 'green'], [215, 'turquoise'],
  [300, 'blue'], [318, 'violet'], [345, 'purple'], [360, 'pink'],
];

// "brown", "pale blue". Requires: "#rrggbb".
export const colorName = (hex: string): string => {
  const lab = labFromHex(hex);
  const chroma = chromaOf(lab);
  if (chroma < 6) return lab.l > 92 ? 'white' : lab.l < 12 ? 'black' : 'grey';
  const hue = hueOf(lab);
  if (lab.l < 58 && hue > 38 && hue < 92) return chroma < 14 ? 'grey brown' : 'brown';
  const name = hues.find(([end]) => hue <= end)![1];
  if (chroma < 16) return `pale ${name}`;
  return lab.l < 32 ? `dark ${name}` : name;
};

export interface NamedCorrection { readonly view: string; readonly strokes: readonly Stroke[] | null }

const stem = (view: string): string => view.replace(/^.*\//, '').replace(/\.[^.]*$/, '');
const plainName = ({ view, strokes }: NamedCorrection): string => {
  const fills = new Set((strokes ?? []).map((stroke) => (stroke.keep ? 'grey' : stroke.color ? colorName(stroke.color) : 'colour')));
  const what = fills.size === 0 ? 'Painted picture' : fills.size > 2 ? 'Several colours' : [...fills].join(' and ');
  return `${what[0]!.toUpperCase()}${what.slice(1)} on ${stem(view)}`;
};
// Names of corrections in their order; equal ones are numbered.
export const correctionNames = (corrections: readonly NamedCorrection[]): string[] => {
  const plain = corrections.map(plainName);
  return plain.map((name, i) => {
    const before = plain.slice(0, i).filter((other) => other === name).length;
    return before > 0 || plain.lastIndexOf(name) !== i ? `${name} (${before + 1})` : name;
  });
};
