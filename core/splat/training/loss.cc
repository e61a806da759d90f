#include "core/splat/training/loss.h"

#include <algorithm>

#include "core/base/flush_to_zero.h"
#include "core/simd/instruction_set.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/splat/training/loss.cc"
#include <hwy/foreach_target.h>

#include "core/simd/simd-inl.h"

#ifndef COLOR3D_SPLAT_LOSS_ONCE
#define COLOR3D_SPLAT_LOSS_ONCE
namespace color3d {
namespace {

constexpr int kReach = 5;  // of the 11-tap window
constexpr int kPad = 16;   // zeros on either side of a row buffer
// exp(-k^2 / (2 1.5^2)) / sum for k = 0..5.
constexpr float kTaps[kReach + 1] = {
    0.26601172f, 0.21300554f, 0.10936069f, 0.036000773f, 0.0075987581f, 0.0010283801f};

struct Terms {
  const PlaneBuffer& x;
  const PlaneBuffer& y;
  const PlaneBuffer* weight;
  const float* zeros;    // a row of zeros with kPad more on either side
  float l1, ssim, edge;  // weights divided by the number of terms of the mean; edge 0: no edge term
  PlaneBuffer& gradient;
};

// Rolling state of a band of rows: the last rows of the derivatives by the blurred moments and by
// the Laplacian, and row buffers.
enum BandMap { kDMean, kDSquare, kDProduct, kDLaplacian, kBandMaps };
constexpr int kBandRows = 2 * kReach + 1;
constexpr int kRowBuffers = 5;
struct Band {
  float* data;  // zero where padded
  int stride;   // of the picture

  static size_t FloatsFor(int stride) {
    return static_cast<size_t>(kBandMaps * kBandRows + kRowBuffers) * (stride + 2 * kPad);
  }
  float* Slot(int slot) const {
    return data + static_cast<size_t>(slot) * (stride + 2 * kPad) + kPad;
  }
  float* Row(BandMap map, int y) const { return Slot(map * kBandRows + y % kBandRows); }
  float* Buffer(int k) const { return Slot(kBandMaps * kBandRows + k); }
};

}  // namespace
}  // namespace color3d
#endif  // COLOR3D_SPLAT_LOSS_ONCE

HWY_BEFORE_NAMESPACE();
namespace color3d {
namespace HWY_NAMESPACE {
namespace {

using simd::Broadcast;
using simd::F32;
using simd::Mask;

const float* RowOrZeros(const PlaneBuffer& p, int c, int y, const float* zeros) {
  return y >= 0 && y < p.height ? p.Row(c, y) : zeros;
}

const float* RowOrZeros(const Terms& t, const Band& band, BandMap map, int y) {
  return y >= 0 && y < t.x.height ? band.Row(map, y) : t.zeros;
}

F32 BlurAlongRow(const float* p) {
  F32 sum = kTaps[0] * simd::Load(p);
  for (int k = 1; k <= kReach; ++k) {
    sum = sum + kTaps[k] * (simd::Load(p - k) + simd::Load(p + k));
  }
  return sum;
}

// Pixel weights, zero beyond the picture's width.
F32 PixelWeights(const Terms& t, int y, int x0) {
  const F32 column = simd::LaneIndex() + static_cast<float>(x0);
  const Mask inside = simd::Less(column, Broadcast(static_cast<float>(t.x.width)));
  const F32 w = t.weight == nullptr ? Broadcast(1.0f) : simd::Load(t.weight->Row(0, y) + x0);
  return simd::SelectOrZero(inside, w);
}

// Vertical blur of x, y, x^2, y^2, xy of row r into five padded row buffers.
void BlurColumns(const Terms& t, int c, int r, float* const out[5]) {
  const float *xs[2 * kReach + 1], *ys[2 * kReach + 1];
  for (int k = -kReach; k <= kReach; ++k) {
    xs[k + kReach] = RowOrZeros(t.x, c, r + k, t.zeros);
    ys[k + kReach] = RowOrZeros(t.y, c, r + k, t.zeros);
  }
  for (int j = 0; j < t.x.stride; j += simd::kLanes) {
    const F32 x0 = simd::Load(xs[kReach] + j), y0 = simd::Load(ys[kReach] + j);
    F32 sx = kTaps[0] * x0, sy = kTaps[0] * y0;
    F32 sxx = sx * x0, syy = sy * y0, sxy = sx * y0;
    for (int k = 1; k <= kReach; ++k) {
      const F32 xa = simd::Load(xs[kReach - k] + j), xb = simd::Load(xs[kReach + k] + j);
      const F32 ya = simd::Load(ys[kReach - k] + j), yb = simd::Load(ys[kReach + k] + j);
      sx = sx + kTaps[k] * (xa + xb);
      sy = sy + kTaps[k] * (ya + yb);
      sxx = sxx + kTaps[k] * (xa * xa + xb * xb);
      syy = syy + kTaps[k] * (ya * ya + yb * yb);
      sxy = sxy + kTaps[k] * (xa * ya + xb * yb);
    }
    simd::Store(out[0] + j, sx);
    simd::Store(out[1] + j, sy);
    simd::Store(out[2] + j, sxx);
    simd::Store(out[3] + j, syy);
    simd::Store(out[4] + j, sxy);
  }
}

// 1 - SSIM of row r, its derivatives by the blurred moments, and L1's value.
void StructureRow(const Terms& t, int c, int r, const Band& band, double* sums) {
  float* rows[5];
  for (int k = 0; k < 5; ++k) rows[k] = band.Buffer(k);
  BlurColumns(t, c, r, rows);
  F32 l1 = simd::Zero(), dissimilarity = simd::Zero();
  const float *x = t.x.Row(c, r), *y = t.y.Row(c, r);
  float *d_mean = band.Row(kDMean, r), *d_square = band.Row(kDSquare, r);
  float* d_product = band.Row(kDProduct, r);
  for (int j = 0; j < t.x.stride; j += simd::kLanes) {
    const F32 w = PixelWeights(t, r, j);
    const F32 d = simd::Load(x + j) - simd::Load(y + j);
    l1 = l1 + w * simd::Abs(d);
    const F32 mx = BlurAlongRow(rows[0] + j), my = BlurAlongRow(rows[1] + j);
    const F32 sx = BlurAlongRow(rows[2] + j) - mx * mx;
    const F32 sy = BlurAlongRow(rows[3] + j) - my * my;
    const F32 sxy = BlurAlongRow(rows[4] + j) - mx * my;
    const F32 a1 = 2.0f * mx * my + kSsimC1, a2 = 2.0f * sxy + kSsimC2;
    const F32 b1 = simd::Reciprocal(mx * mx + my * my + kSsimC1);
    const F32 b2 = simd::Reciprocal(sx + sy + kSsimC2);
    const F32 ssim = a1 * a2 * b1 * b2;
    dissimilarity = dissimilarity + w * (1.0f - ssim);
    const F32 scale = -t.ssim * w;
    simd::Store(d_square + j, -scale * ssim * b2);
    simd::Store(d_product + j, scale * 2.0f * a1 * b1 * b2);
    simd::Store(d_mean + j, scale * 2.0f * (my * (a2 - a1) * b1 * b2 - mx * ssim * (b1 - b2)));
  }
  sums[0] = simd::HorizontalSum(l1);
  sums[1] = simd::HorizontalSum(dissimilarity);
}

// Charbonnier of the Laplacian of x - y on row r's inner pixels, and its derivative.
void EdgeRow(const Terms& t, int c, int r, const Band& band, double* sum) {
  const float *x = t.x.Row(c, r), *y = t.y.Row(c, r);
  const int stride = t.x.stride;
  float* out = band.Row(kDLaplacian, r);
  F32 total = simd::Zero();
  for (int j = 0; j < stride; j += simd::kLanes) {
    const auto difference = [&](int offset) HWY_ATTR {
      return simd::Load(x + j + offset) - simd::Load(y + j + offset);
    };
    const F32 laplacian = difference(-1) + difference(1) + difference(-stride) +
                          difference(stride) - 4.0f * difference(0);
    const F32 column = simd::LaneIndex() + static_cast<float>(j);
    const Mask inner = simd::And(simd::GreaterEqual(column, Broadcast(1.0f)),
                                 simd::Less(column, Broadcast(static_cast<float>(t.x.width - 1))));
    const F32 w = simd::SelectOrZero(inner, PixelWeights(t, r, j));
    const F32 charbonnier =
        simd::Sqrt(laplacian * laplacian + kCharbonnierEpsilon * kCharbonnierEpsilon);
    total = total + w * charbonnier;
    simd::Store(out + j, t.edge * w * laplacian / charbonnier);
  }
  *sum = simd::HorizontalSum(total);
}

// dL/dx of row r: the adjoint of the blur, L1's sign, the adjoint of the Laplacian.
void GradientRow(const Terms& t, int c, int r, const Band& band) {
  const int stride = t.x.stride;
  float* rows[3];
  for (int m = 0; m < 3; ++m) {
    rows[m] = band.Buffer(m);
    const float* taps[2 * kReach + 1];
    for (int k = -kReach; k <= kReach; ++k) {
      taps[k + kReach] = RowOrZeros(t, band, static_cast<BandMap>(m), r + k);
    }
    for (int j = 0; j < stride; j += simd::kLanes) {
      F32 sum = kTaps[0] * simd::Load(taps[kReach] + j);
      for (int k = 1; k <= kReach; ++k) {
        sum =
            sum + kTaps[k] * (simd::Load(taps[kReach - k] + j) + simd::Load(taps[kReach + k] + j));
      }
      simd::Store(rows[m] + j, sum);
    }
  }
  // The border rows have no Laplacian of their own.
  const auto laplacian = [&](int row) {
    const bool inner = t.edge > 0.0f && row > 0 && row + 1 < t.x.height;
    return inner ? band.Row(kDLaplacian, row) : t.zeros;
  };
  const float *up = laplacian(r - 1), *here = laplacian(r), *down = laplacian(r + 1);
  const float *x = t.x.Row(c, r), *y = t.y.Row(c, r);
  for (int j = 0; j < stride; j += simd::kLanes) {
    const F32 xv = simd::Load(x + j), yv = simd::Load(y + j);
    const F32 w = PixelWeights(t, r, j);
    const F32 d = xv - yv;
    const F32 sign = simd::SelectOrZero(simd::Less(Broadcast(0.0f), d), Broadcast(1.0f)) -
                     simd::SelectOrZero(simd::Less(d, Broadcast(0.0f)), Broadcast(1.0f));
    F32 g = BlurAlongRow(rows[0] + j) + 2.0f * xv * BlurAlongRow(rows[1] + j) +
            yv * BlurAlongRow(rows[2] + j);
    g = g + t.l1 * w * sign;
    g = g + simd::Load(up + j) + simd::Load(down + j) + simd::Load(here + j - 1) +
        simd::Load(here + j + 1) - 4.0f * simd::Load(here + j);
    const F32 column = simd::LaneIndex() + static_cast<float>(j);
    const Mask inside = simd::Less(column, Broadcast(static_cast<float>(t.x.width)));
    simd::Store(t.gradient.Row(c, r) + j, simd::SelectOrZero(inside, g));
  }
}

// Rows [first, end) of channel c, streaming: the gradient follows kReach rows behind the terms, so
// that the rows between stay in the cache. Rows beyond the band's ends are computed twice.
void LossRows(const Terms& t, int c, int first, int end, float* scratch, double* row_sums) {
  const Band band{scratch, t.x.stride};
  for (int r = first - kReach; r < end + kReach; ++r) {
    if (r >= 0 && r < t.x.height) {
      double beyond[3];
      double* sums = r >= first && r < end ? row_sums + 3 * r : beyond;
      StructureRow(t, c, r, band, sums);
      if (t.edge > 0.0f && r > 0 && r + 1 < t.x.height) EdgeRow(t, c, r, band, sums + 2);
    }
    if (r - kReach >= first) GradientRow(t, c, r - kReach, band);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace color3d
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace color3d {
namespace {
HWY_EXPORT(LossRows);
}  // namespace

LossValue ImageLoss::Evaluate(const PlaneBuffer& x,
                              const PlaneBuffer& y,
                              const PlaneBuffer* pixel_weight,
                              const LossWeights& weights,
                              ThreadPool& pool,
                              PlaneBuffer& gradient) {
  gradient.Reset(x.width, x.height, x.channels);
  zeros_.assign(x.stride + 2 * kPad, 0.0f);
  scratch_.resize(pool.thread_count());
  for (AlignedFloats& s : scratch_) s.assign(Band::FloatsFor(x.stride), 0.0f);
  const int64_t rows = static_cast<int64_t>(x.channels) * x.height;
  row_sums_.assign(rows * 3, 0.0);
  const double pixels = static_cast<double>(x.width) * x.height * x.channels;
  const double inner = x.width > 2 && x.height > 2
                           ? static_cast<double>(x.width - 2) * (x.height - 2) * x.channels
                           : 1.0;
  const bool edge = weights.edge > 0.0f && x.width > 2 && x.height > 2;
  const Terms t{x,
                y,
                pixel_weight,
                zeros_.data() + kPad,
                static_cast<float>(weights.l1 / pixels),
                static_cast<float>(weights.ssim / pixels),
                edge ? static_cast<float>(weights.edge / inner) : 0.0f,
                gradient};
  const auto loss_rows = &COLOR3D_KERNEL(LossRows);
  pool.ForRanges(rows, [&](int64_t begin, int64_t end, int thread) {
    const ScopedFlushToZero flush;
    while (begin < end) {
      const int64_t c = begin / x.height, first = c * x.height;
      const int64_t stop = std::min(end, first + x.height);
      loss_rows(t,
                static_cast<int>(c),
                static_cast<int>(begin - first),
                static_cast<int>(stop - first),
                scratch_[thread].data(),
                row_sums_.data() + 3 * first);
      begin = stop;
    }
  });
  LossValue value;
  for (int64_t i = 0; i < rows; ++i) {
    value.l1 += row_sums_[3 * i] / pixels;
    value.ssim += row_sums_[3 * i + 1] / pixels;
    value.edge += row_sums_[3 * i + 2] / inner;
  }
  value.total = weights.l1 * value.l1 + weights.ssim * value.ssim + weights.edge * value.edge;
  return value;
}

}  // namespace color3d
#endif  // HWY_ONCE
