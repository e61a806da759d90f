#include "core/carry/plane_sweep_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "core/simd/instruction_set.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/carry/plane_sweep_kernels.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace color3d {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using FloatTag = hn::CappedTag<float, 16>;
using IntTag = hn::RebindToSigned<FloatTag>;
using WordTag = hn::RebindToUnsigned<FloatTag>;
using Floats = hn::Vec<FloatTag>;

constexpr uint32_t kUnknown = 0x80000000u;
constexpr uint8_t kUnknownCost = 11;  // about chance
constexpr int kSide = 2 * kCensusRadius + 1;
constexpr int kRowMultiple = 16;  // the widest register

// Rows with a margin of kCensusRadius repeated pixels on either side, for one window at a time.
class PaddedRows {
 public:
  explicit PaddedRows(int width)
      : width_(width), stride_(width + 2 * kCensusRadius + kRowMultiple) {
    data_.resize(static_cast<size_t>(kSide) * stride_);
  }
  // The first pixel of row y.
  float* Row(int y) {
    return data_.data() + static_cast<size_t>(y + kSide) % kSide * stride_ + kCensusRadius;
  }
  void RepeatBorders(int y) {
    float* row = Row(y);
    std::fill_n(row - kCensusRadius, kCensusRadius, row[0]);
    std::fill_n(row + width_, kCensusRadius, row[width_ - 1]);
  }

 private:
  int width_;
  int stride_;
  std::vector<float> data_;
};

// The census bits of the pixels from x on; rows[kCensusRadius] is their own row.
HWY_INLINE hn::Vec<WordTag> CensusBits(const float* const* rows, int x) {
  const FloatTag d;
  const WordTag words;
  const Floats center = hn::LoadU(d, rows[kCensusRadius] + x);
  auto bits = hn::Zero(words);
  uint32_t bit = 1;
  for (int dy = -kCensusRadius; dy <= kCensusRadius; ++dy) {
    const float* row = rows[dy + kCensusRadius] + x;
    for (int dx = -kCensusRadius; dx <= kCensusRadius; ++dx) {
      if ((dx + dy) % 2 != 0 || (dx == 0 && dy == 0)) continue;
      const auto darker = hn::RebindMask(words, hn::Lt(hn::LoadU(d, row + dx), center));
      bits = hn::Or(bits, hn::IfThenElseZero(darker, hn::Set(words, bit)));
      bit <<= 1;
    }
  }
  return bits;
}

// Calls fill(y, row) for the rows of a picture in order, and use(y, rows) for each as soon as its
// window is complete. Rows outside of the picture repeat its outermost ones.
template <class Fill, class Use>
HWY_INLINE void ForWindows(int width, int height, const Fill& fill, const Use& use) {
  PaddedRows padded(width);
  int filled = 0;
  for (int y = 0; y < height; ++y) {
    for (; filled < std::min(height, y + kCensusRadius + 1); ++filled) {
      fill(filled, padded.Row(filled));
      padded.RepeatBorders(filled);
    }
    const float* rows[kSide];
    for (int dy = -kCensusRadius; dy <= kCensusRadius; ++dy) {
      rows[dy + kCensusRadius] = padded.Row(std::clamp(y + dy, 0, height - 1));
    }
    use(y, rows);
  }
}

void Census(const Image& luminance, const Image& mask, CensusImage& census) {
  const int width = census.width;
  ForWindows(
      width,
      census.height,
      [&](int y, float* row) HWY_ATTR {
        std::copy_n(luminance.data.data() + static_cast<size_t>(y) * width, width, row);
      },
      [&](int y, const float* const* rows) HWY_ATTR {
        const WordTag words;
        uint32_t* out = census.words.data() + static_cast<size_t>(y) * census.stride;
        for (int x = 0; x < width; x += static_cast<int>(hn::Lanes(words))) {
          hn::StoreU(CensusBits(rows, x), words, out + x);
        }
        for (int x = 0; x < width && !mask.Empty(); ++x) {
          if (mask.At(0, y, x) == 0.0f) out[x] |= kUnknown;
        }
      });
}

// Samples row y of the source as the reference sees it through the plane. `unknown` is kUnknown
// outside of the source and where it is masked, else 0.
HWY_INLINE void WarpRow(const Image& source,
                        const Image& source_mask,
                        const std::array<float, 9>& h,
                        int y,
                        int width,
                        float* out,
                        uint32_t* unknown) {
  const FloatTag d;
  const IntTag ints;
  const WordTag words;
  const float py = y + 0.5f;
  const auto stride = hn::Set(ints, source.width);
  const auto zero = hn::Zero(d), one = hn::Set(d, 1.0f), half = hn::Set(d, 0.5f);
  const auto max_x = hn::Set(d, static_cast<float>(source.width - 1));
  const auto max_y = hn::Set(d, static_cast<float>(source.height - 1));
  const float* pixels = source.data.data();
  for (int x = 0; x < width; x += static_cast<int>(hn::Lanes(d))) {
    const auto px = hn::Add(hn::Iota(d, static_cast<float>(x)), half);
    const auto along = [&](int row) HWY_ATTR {
      return hn::MulAdd(hn::Set(d, h[row]), px, hn::Set(d, h[row + 1] * py + h[row + 2]));
    };
    const auto w = along(6);
    const auto least = hn::Set(d, 1e-6f);
    const auto inverse = hn::Div(one, hn::Max(w, least));
    const auto sx = hn::Sub(hn::Mul(along(0), inverse), half);
    const auto sy = hn::Sub(hn::Mul(along(3), inverse), half);
    auto inside = hn::And(hn::Gt(w, least), hn::And(hn::Ge(sx, zero), hn::Ge(sy, zero)));
    inside = hn::And(inside, hn::And(hn::Le(sx, max_x), hn::Le(sy, max_y)));
    const auto column = hn::IfThenElseZero(inside, sx), line = hn::IfThenElseZero(inside, sy);
    const auto x0 = hn::Min(hn::ConvertTo(ints, column), hn::Set(ints, source.width - 2));
    const auto y0 = hn::Min(hn::ConvertTo(ints, line), hn::Set(ints, source.height - 2));
    const auto tx = hn::Sub(column, hn::ConvertTo(d, x0));
    const auto ty = hn::Sub(line, hn::ConvertTo(d, y0));
    const auto at = hn::Add(hn::Mul(y0, stride), x0);
    const auto sample = [&](int offset)
                            HWY_ATTR { return hn::GatherIndex(d, pixels + offset, at); };
    const auto top_left = sample(0), bottom_left = sample(source.width);
    const auto top = hn::MulAdd(tx, hn::Sub(sample(1), top_left), top_left);
    const auto bottom = hn::MulAdd(tx, hn::Sub(sample(source.width + 1), bottom_left), bottom_left);
    hn::StoreU(hn::MulAdd(ty, hn::Sub(bottom, top), top), d, out + x);
    if (!source_mask.Empty()) {
      const auto nearest = hn::Add(hn::Mul(hn::ConvertTo(ints, hn::Add(line, half)), stride),
                                   hn::ConvertTo(ints, hn::Add(column, half)));
      inside = hn::And(inside, hn::Ne(hn::GatherIndex(d, source_mask.data.data(), nearest), zero));
    }
    hn::StoreU(hn::IfThenZeroElse(hn::RebindMask(words, inside), hn::Set(words, kUnknown)),
               words,
               unknown + x);
  }
}

void Match(const CensusImage& reference,
           const Image& source,
           const Image& source_mask,
           const std::array<float, 9>& homography,
           std::vector<uint8_t>& costs) {
  const int width = reference.width;
  std::vector<uint32_t> unknown(static_cast<size_t>(kSide) * reference.stride);
  const auto unknown_row = [&](int y) {
    return unknown.data() + static_cast<size_t>(y) % kSide * reference.stride;
  };
  ForWindows(
      width,
      reference.height,
      [&](int y, float* row)
          HWY_ATTR { WarpRow(source, source_mask, homography, y, width, row, unknown_row(y)); },
      [&](int y, const float* const* rows) HWY_ATTR {
        const WordTag words;
        const hn::Rebind<uint8_t, WordTag> bytes;
        const uint32_t* of_reference =
            reference.words.data() + static_cast<size_t>(y) * reference.stride;
        const uint32_t* missing = unknown_row(y);
        uint8_t* out = costs.data() + static_cast<size_t>(y) * reference.stride;
        const auto unknown_bit = hn::Set(words, kUnknown);
        for (int x = 0; x < width; x += static_cast<int>(hn::Lanes(words))) {
          const auto known = hn::LoadU(words, of_reference + x);
          const auto either = hn::Or(known, hn::LoadU(words, missing + x));
          const auto differing =
              hn::PopulationCount(hn::AndNot(unknown_bit, hn::Xor(known, CensusBits(rows, x))));
          const auto is_known = hn::Eq(hn::And(either, unknown_bit), hn::Zero(words));
          const auto cost = hn::IfThenElse(is_known, differing, hn::Set(words, kUnknownCost));
          hn::StoreU(hn::DemoteTo(bytes, hn::BitCast(IntTag(), cost)), bytes, out + x);
        }
      });
}

// The cost of each source is inserted into the sorted ones, for all elements of a block at once.
void Smallest(const std::vector<std::vector<uint8_t>>& costs,
              int kept,
              std::vector<uint8_t>& mean) {
  constexpr size_t kBlock = 256;
  std::vector<std::array<uint8_t, kBlock>> smallest(kept);
  for (size_t first = 0; first < mean.size(); first += kBlock) {
    const size_t count = std::min(kBlock, mean.size() - first);
    for (auto& values : smallest) values.fill(std::numeric_limits<uint8_t>::max());
    for (const std::vector<uint8_t>& of_source : costs) {
      std::array<uint8_t, kBlock> sinking = {};
      std::copy_n(of_source.data() + first, count, sinking.data());
      for (auto& values : smallest) {
        for (size_t i = 0; i < kBlock; ++i) {
          const uint8_t least = std::min(values[i], sinking[i]);
          sinking[i] = std::max(values[i], sinking[i]);
          values[i] = least;
        }
      }
    }
    std::array<uint16_t, kBlock> sums = {};
    for (const auto& values : smallest) {
      for (size_t i = 0; i < kBlock; ++i) sums[i] = static_cast<uint16_t>(sums[i] + values[i]);
    }
    for (size_t i = 0; i < count; ++i) {
      mean[first + i] = static_cast<uint8_t>(sums[i] * kCostScale / kept);
    }
  }
}

// Costs of the paths that arrive at the previous pixel, and of changing the plane after it.
struct PathCosts {
  const int16_t* paths;  // per plane; [-1] and [planes] are padding with a high cost
  int16_t least;
  int16_t small_step;
  int16_t large_step;
};

// Best cost of a path that arrives at a pixel, per plane.
void PathStep(const uint8_t* cost, PathCosts previous, int planes, int16_t* out, int16_t* sum) {
  const auto jump = static_cast<int16_t>(previous.least + previous.large_step);
  for (int d = 0; d < planes; ++d) {
    const int16_t* path = previous.paths + d;
    int16_t best = std::min(*path, jump);
    best = std::min<int16_t>(best, static_cast<int16_t>(path[-1] + previous.small_step));
    best = std::min<int16_t>(best, static_cast<int16_t>(path[1] + previous.small_step));
    const auto value = static_cast<int16_t>(cost[d] + best - previous.least);
    out[d] = value;
    sum[d] = static_cast<int16_t>(sum[d] + value);
  }
}

void PathsAlong(const CostVolume& volume,
                const Image& luminance,
                const PathPenalties& penalties,
                int dx,
                int dy,
                std::vector<int16_t>& sum) {
  const int width = volume.width, height = volume.height, planes = volume.planes;
  const int stride = planes + 2;
  constexpr int16_t kHigh = 8000;
  const auto small_step = static_cast<int16_t>(penalties.small_step * kCostScale);
  std::vector<int16_t> rows[2];
  std::vector<int16_t> least[2];
  for (int i = 0; i < 2; ++i) {
    rows[i].assign(static_cast<size_t>(width) * stride, kHigh);
    least[i].assign(width, 0);
  }
  const int first_y = dy < 0 ? height - 1 : 0, step_y = dy < 0 ? -1 : 1;
  const bool backwards = dx < 0 || (dx == 0 && dy < 0);
  for (int n = 0; n < height; ++n) {
    const int y = first_y + n * step_y;
    auto& current = rows[n & 1];
    auto& current_least = least[n & 1];
    const auto& above = dy == 0 ? current : rows[1 - (n & 1)];
    const auto& above_least = dy == 0 ? current_least : least[1 - (n & 1)];
    for (int m = 0; m < width; ++m) {
      const int x = backwards ? width - 1 - m : m;
      const size_t pixel = static_cast<size_t>(y) * width + x;
      const uint8_t* cost = volume.cost.data() + pixel * planes;
      int16_t* out = current.data() + static_cast<size_t>(x) * stride + 1;
      int16_t* total = sum.data() + pixel * planes;
      const int px = x - dx, py = y - dy;
      if (px < 0 || px >= width || py < 0 || py >= height) {
        for (int d = 0; d < planes; ++d) {
          out[d] = cost[d];
          total[d] = static_cast<int16_t>(total[d] + cost[d]);
        }
      } else {
        const double contrast = std::abs(luminance.At(0, y, x) - luminance.At(0, py, px));
        const double large = penalties.large_step / (1.0 + contrast / penalties.edge_contrast);
        const auto large_step = static_cast<int16_t>(
            kCostScale * std::max(large, penalties.small_step + 1.0 / kCostScale));
        const int16_t* paths = above.data() + static_cast<size_t>(px) * stride + 1;
        PathStep(cost, {paths, above_least[px], small_step, large_step}, planes, out, total);
      }
      int16_t smallest = out[0];
      for (int d = 1; d < planes; ++d) smallest = std::min(smallest, out[d]);
      current_least[x] = smallest;
    }
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace color3d
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace color3d {

HWY_EXPORT(Census);
HWY_EXPORT(Match);
HWY_EXPORT(Smallest);
HWY_EXPORT(PathsAlong);

CensusImage CensusOf(const Image& luminance, const Image& mask) {
  constexpr int kMultiple = 16;
  CensusImage census{luminance.width,
                     luminance.height,
                     (luminance.width + kMultiple - 1) / kMultiple * kMultiple,
                     {}};
  census.words.resize(static_cast<size_t>(census.stride) * census.height);
  COLOR3D_KERNEL(Census)(luminance, mask, census);
  return census;
}

void MatchSource(const CensusImage& reference,
                 const Image& source,
                 const Image& source_mask,
                 const std::array<float, 9>& homography,
                 std::vector<uint8_t>* costs) {
  costs->resize(reference.words.size());
  COLOR3D_KERNEL(Match)(reference, source, source_mask, homography, *costs);
}

void MeanOfSmallest(const std::vector<std::vector<uint8_t>>& costs,
                    int kept,
                    std::vector<uint8_t>* mean) {
  mean->resize(costs.front().size());
  COLOR3D_KERNEL(Smallest)(costs, kept, *mean);
}

void AddPathCosts(const CostVolume& volume,
                  const Image& luminance,
                  const PathPenalties& penalties,
                  int dx,
                  int dy,
                  std::vector<int16_t>& sum) {
  COLOR3D_KERNEL(PathsAlong)(volume, luminance, penalties, dx, dy, sum);
}

}  // namespace color3d
#endif  // HWY_ONCE
