// The edge weights by which the service spreads strokes (core/grid/edge_weights.h): 1 / (1 + |dL / sigma|^3) of L
// after a binomial 3x3 filter.

// 1 channel, L 0..100.
export interface Luminance {
  readonly width: number;
  readonly height: number;
  readonly data: Float32Array;
}

// Binomial 3x3 filter with repeated borders.
export const smoothed = ({ width: w, height: h, data }: Luminance): Luminance => {
  const out = new Float32Array(w * h);
  for (let y = 0; y < h; ++y) {
    const above = Math.max(y - 1, 0) * w, here = y * w, below = Math.min(y + 1, h - 1) * w;
    const column = (x: number) => data[above + x] + 2 * data[here + x] + data[below + x];
    for (let x = 0; x < w; ++x) {
      out[here + x] = 0.0625 * (column(Math.max(x - 1, 0)) + 2 * column(x) + column(Math.min(x + 1, w - 1)));
    }
  }
  return { width: w, height: h, data: out };
};

// Of two horizontal or vertical neighbours; diagonal ones have it over sqrt(2).
export const edgeWeight = (x: number, y: number, sigma: number): number => {
  const ratio = Math.abs(x - y) / sigma;
  return 1 / (1 + ratio * ratio * ratio);
};
