// What a stroke touches in all photos, in numbers.
import { histogramOf, touchedShare, type Histogram } from './model/heat';
import { pixelsOf } from './view/shading';

const side = 64; // px, enough for shares

export class Touched {
  private readonly histograms = new Map<string, Histogram>();

  set(view: string, pull: ImageBitmap): void {
    const height = Math.max(1, Math.round((side * pull.height) / pull.width));
    this.histograms.set(view, histogramOf(pixelsOf(pull, side, height), 4));
  }
  has(view: string): boolean {
    return this.histograms.has(view);
  }
  share(view: string, reach: number): number | null {
    const histogram = this.histograms.get(view);
    return histogram ? touchedShare(histogram, reach) : null;
  }
  clear(): void {
    this.histograms.clear();
  }
  // `all`: number of photos that are looked at.
  text(reach: number, all: number): string {
    const shares = [...this.histograms].map(([view, histogram]) => ({ view, share: touchedShare(histogram, reach) }));
    const touched = shares.filter(({ share }) => share >= 0.005).sort((a, b) => b.share - a.share);
    if (!touched.length) return 'It touches only what you drew on.';
    const stem = (view: string): string => view.replace(/^.*\//, '').replace(/\.[^.]*$/, '');
    const most = touched.slice(0, 3).map(({ view, share }) => `${stem(view)} (${Math.max(1, Math.round(100 * share))} %)`).join(', ');
    const of = shares.length < all ? `the first ${shares.length}` : `${shares.length}`;
    return `It touches ${touched.length} of ${of} photos, most of all ${most}.`;
  }
}
