// The time of a film: frames, shots, and the parts of it that have other colours. Pure functions. Frames are
// numbers from 0 in order of time; both ends of a span belong to it.

export interface FilmTimes {
  readonly names: readonly string[]; // of the frames, as the service calls them
  readonly times: readonly number[]; // seconds, ascending
  readonly shots: readonly number[];
}
export interface Span { readonly begin: number; readonly end: number }
export interface Part extends Span { readonly frame: number } // the coloured frame, within the span
export type Edge = 'begin' | 'end';

const sameTime = 1e-6; // as the service compares times, seconds

export const evenTimes = (frames: number, perSecond: number): number[] =>
  Array.from({ length: frames }, (_, i) => i / perSecond);

// The usual time from a frame to the next, seconds.
export const stepOf = (times: readonly number[]): number => {
  const steps = times.slice(1).map((time, i) => time - times[i]!).sort((a, b) => a - b);
  return steps[steps.length >> 1] ?? 0.04;
};

export const secondsOf = (times: readonly number[]): number =>
  times.length ? times[times.length - 1]! - times[0]! + stepOf(times) : 0;

// The frame that is shown at this time.
export const frameAt = (times: readonly number[], seconds: number): number => {
  let low = 0, high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle]! <= seconds + sameTime) low = middle;
    else high = middle - 1;
  }
  return low;
};

// A time at which the frame is shown for certain, in a player that rounds times.
export const insideOf = (times: readonly number[], frame: number): number => {
  const next = times[frame + 1] ?? times[frame]! + stepOf(times);
  return 0.6 * times[frame]! + 0.4 * next;
};

export const frameOfName = (names: readonly string[], name: string): number => {
  const exact = names.indexOf(name);
  if (exact >= 0) return exact;
  const stem = (text: string): string => text.replace(/\.[^./]*$/, '');
  return names.findIndex((other) => stem(other) === stem(name));
};

// Runs of frames of one shot, in order. A torn frame is a run of its own.
export const runsOf = (shots: readonly number[]): (Span & { readonly shot: number })[] => {
  const runs: (Span & { shot: number })[] = [];
  shots.forEach((shot, i) => {
    const last = runs[runs.length - 1];
    if (last && last.shot === shot) runs[runs.length - 1] = { ...last, end: i };
    else runs.push({ shot, begin: i, end: i });
  });
  return runs;
};

export const shotSpan = (shots: readonly number[], frame: number): Span => ({
  begin: shots.indexOf(shots[frame]!), end: shots.lastIndexOf(shots[frame]!),
});

const meet = (a: Span, b: Span): boolean => a.begin <= b.end && b.begin <= a.end;
const equal = (a: Span, b: Span): boolean => a.begin === b.begin && a.end === b.end;

// How far the part may reach: in its shot, up to other parts there. Parts of one span move together.
export const limitsOf = (part: Part, parts: readonly Part[], film: FilmTimes): Span => {
  let { begin, end } = shotSpan(film.shots, part.frame);
  for (const other of parts) {
    if (other === part || equal(other, part) || film.shots[other.frame] !== film.shots[part.frame]) continue;
    if (other.end < part.begin) begin = Math.max(begin, other.end + 1);
    if (other.begin > part.end) end = Math.min(end, other.begin - 1);
  }
  return { begin, end };
};

// All parts after one edge of the part at `index` has been moved to a frame, as far as that is possible.
export const withEdge = <P extends Part>(
  parts: readonly P[], index: number, edge: Edge, frame: number, film: FilmTimes,
): P[] => {
  const part = parts[index]!;
  const limits = limitsOf(part, parts, film);
  const together = parts.filter((other) => equal(other, part) && film.shots[other.frame] === film.shots[part.frame]);
  const keys = together.map((other) => other.frame);
  const to = edge === 'begin'
    ? Math.min(Math.max(frame, limits.begin), Math.min(...keys))
    : Math.max(Math.min(frame, limits.end), Math.max(...keys));
  return parts.map((other) => (together.includes(other) ? { ...other, [edge]: to } : other));
};

// The span of a new part at a frame: about a second to either side, or that of the part that is there.
export const newSpan = (frame: number, parts: readonly Part[], film: FilmTimes): Span => {
  const there = parts.find((part) => part.begin <= frame && frame <= part.end && film.shots[part.frame] === film.shots[frame]);
  if (there) return { begin: there.begin, end: there.end };
  const limits = limitsOf({ frame, begin: frame, end: frame }, parts, film);
  const time = film.times[frame]!;
  const first = frameAt(film.times, Math.max(film.times[0]!, time - 1)), last = frameAt(film.times, time + 1);
  return { begin: Math.max(first, limits.begin), end: Math.min(last, limits.end) };
};

// True if no two parts of one shot overlap but for those of one span, and each has its frame inside.
export const partsFit = (parts: readonly Part[], film: FilmTimes): boolean => parts.every((part, i) =>
  part.begin <= part.frame && part.frame <= part.end && parts.every((other, j) => j <= i
    || film.shots[other.frame] !== film.shots[part.frame] || equal(other, part) || !meet(other, part)));

// The coloured frame from which a frame has its colours: the nearest one in time of its shot; -1: none.
export const keyOf = (frame: number, keys: readonly number[], film: FilmTimes): number => {
  let best = -1, distance = Infinity;
  keys.forEach((key, i) => {
    if (film.shots[key] !== film.shots[frame]) return;
    const apart = Math.abs(film.times[key]! - film.times[frame]!);
    if (apart < distance) [best, distance] = [i, apart];
  });
  return best;
};

const nice = [0.04, 0.1, 0.2, 0.5, 1, 2, 5, 10, 30, 60, 120, 300, 600, 1800, 3600];
// Seconds between marks that stand at least `apart` px from each other.
export const markStep = (seconds: number, width: number, apart: number): number =>
  nice.find((step) => step * width >= apart * seconds) ?? 7200;

// "1:02.40"; without hundredths where they are not asked for.
export const clockOf = (seconds: number, hundredths = true): string => {
  const whole = Math.round(seconds * 100) / 100;
  const minutes = Math.floor(whole / 60);
  const rest = (whole - 60 * minutes).toFixed(hundredths ? 2 : whole % 1 ? 1 : 0);
  return `${minutes}:${rest.padStart(hundredths ? 5 : rest.includes('.') ? 4 : 2, '0')}`;
};
