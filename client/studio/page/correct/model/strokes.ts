// Strokes on a picture, px of the picture, in the form that the studio takes (README.md "Corrections").

export interface Fill { color?: string; keep?: 'neutral' }
export type Stroke =
  | (Fill & { line: [number, number][]; width: number })
  | (Fill & { x: number; y: number; radius: number });

const between = (value: number, low: number, high: number): number => Math.min(high, Math.max(low, value));
const rounded = (value: number): number => Math.round(10 * value) / 10;

// From the path of the pointer. A short path is a disc. Points that tell nothing are left out.
export const strokeOf = (
  path: readonly (readonly [number, number])[], width: number, fill: Fill, size: { width: number; height: number },
): Stroke => {
  const inside = path.map(([x, y]): [number, number] =>
    [rounded(between(x, 0, size.width - 1)), rounded(between(y, 0, size.height - 1))]);
  const kept: [number, number][] = [];
  for (const point of inside) {
    const last = kept.at(-1);
    if (!last || Math.hypot(point[0] - last[0], point[1] - last[1]) >= Math.max(1, width / 6)) kept.push(point);
  }
  const end = inside.at(-1)!;
  if (kept.at(-1) !== end && kept.length > 1) kept.push(end);
  if (kept.length < 2) return { ...fill, x: kept[0]![0], y: kept[0]![1], radius: rounded(width / 2) };
  return { ...fill, line: kept, width: rounded(width) };
};

// The box around strokes, px; at least `least` px wide and high, within the picture.
export const boxOf = (
  strokes: readonly Stroke[], size: { width: number; height: number }, least: number,
): { x: number; y: number; side: number } => {
  const xs: number[] = [];
  const ys: number[] = [];
  for (const stroke of strokes) {
    const points = 'line' in stroke ? stroke.line : [[stroke.x, stroke.y] as [number, number]];
    const half = 'line' in stroke ? stroke.width / 2 : stroke.radius;
    for (const [x, y] of points) {
      xs.push(x - half, x + half);
      ys.push(y - half, y + half);
    }
  }
  const [left, right] = [Math.min(...xs), Math.max(...xs)];
  const [top, bottom] = [Math.min(...ys), Math.max(...ys)];
  const side = Math.min(Math.max(1.6 * (right - left), 1.6 * (bottom - top), least), size.width, size.height);
  return {
    x: between((left + right) / 2 - side / 2, 0, size.width - side),
    y: between((top + bottom) / 2 - side / 2, 0, size.height - side),
    side,
  };
};
