// Texts of credits and sheets. Pure functions; the credit reads as core/image/credit writes it.
import type { Credit } from './calls';

export const creditText = (credit: Credit): string => {
  const part = (before: string, what: string): string => (what ? `${before}${what}${what.endsWith('.') ? ' ' : '. '}` : '');
  return part('Coloured by ', credit.colored_by) + part('Key view by ', credit.key_view_by)
    + part('Original: ', credit.source) + part('Licence: ', credit.licence) + 'Colours are inferred.';
};

// Items for pages of a sheet: `first` on the first, `others` on each that follows.
export const pagesOf = <T>(items: readonly T[], first: number, others: number): T[][] => {
  const pages: T[][] = [items.slice(0, first)];
  for (let at = first; at < items.length; at += others) pages.push(items.slice(at, at + others));
  return pages;
};

// At most `count`, evenly spread, the first one among them.
export const spread = <T>(items: readonly T[], count: number): T[] =>
  items.length <= count ? [...items] : Array.from({ length: count }, (_, i) => items[Math.floor(i * items.length / count)]!);

// What people call a frame of a film: "f000012" is the 13th.
export const frameText = (name: string): string => {
  const number = /^f(\d+)$/.exec(name)?.[1];
  return number ? `Frame ${Number(number) + 1}` : name;
};

// The name of a file without folders and ending.
export const stem = (name: string): string => name.replace(/^.*\//, '').replace(/\.[^.]*$/, '');
