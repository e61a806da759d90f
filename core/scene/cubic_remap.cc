#include "core/scene/cubic_remap.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "core/simd/instruction_set.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/scene/cubic_remap.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace color3d {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using FloatTag = hn::CappedTag<float, 16>;
using IntTag = hn::RebindToSigned<FloatTag>;
using Floats = hn::Vec<FloatTag>;
using Ints = hn::Vec<IntTag>;

struct CubicWeights {
  Floats of[4];
};

HWY_INLINE CubicWeights WeightsAt(Floats t) {
  const FloatTag d;
  const auto half = hn::Set(d, 0.5f);
  const auto t2 = hn::Mul(t, t);
  const auto t3 = hn::Mul(t2, t);
  return {{hn::Sub(t2, hn::Mul(half, hn::Add(t3, t))),
           hn::MulAdd(hn::Set(d, 1.5f), t3, hn::NegMulAdd(hn::Set(d, 2.5f), t2, hn::Set(d, 1.0f))),
           hn::NegMulAdd(hn::Set(d, 1.5f), t3, hn::MulAdd(hn::Set(d, 2.0f), t2, hn::Mul(half, t))),
           hn::Mul(half, hn::Sub(t3, t2))}};
}

// Four neighbours along one axis, replicated at the borders, and their weights.
struct Taps {
  Ints index[4];
  CubicWeights weights;
};

HWY_INLINE Taps TapsAt(Floats position, int size) {
  const FloatTag d;
  const IntTag ints;
  const auto p =
      hn::Min(hn::Max(position, hn::Set(d, -1.0f)), hn::Set(d, static_cast<float>(size)));
  const auto floor = hn::Floor(p);
  const auto first = hn::Sub(hn::ConvertTo(ints, floor), hn::Set(ints, 1));
  Taps taps;
  for (int k = 0; k < 4; ++k) {
    taps.index[k] =
        hn::Min(hn::Max(hn::Add(first, hn::Set(ints, k)), hn::Zero(ints)), hn::Set(ints, size - 1));
  }
  taps.weights = WeightsAt(hn::Sub(p, floor));
  return taps;
}

// One register of pixels. `out`: the first of them in each channel.
HWY_INLINE void RemapPixels(const Image& image,
                            const float* low,
                            const float* high,
                            const float* x,
                            const float* y,
                            float* const* out) {
  const FloatTag d;
  const Taps across = TapsAt(hn::LoadU(d, x), image.width);
  const Taps down = TapsAt(hn::LoadU(d, y), image.height);
  Ints rows[4];
  for (int k = 0; k < 4; ++k) rows[k] = hn::Mul(down.index[k], hn::Set(IntTag(), image.width));
  for (int c = 0; c < image.channels; ++c) {
    const float* plane = image.Plane(c);
    auto sum = hn::Zero(d);
    for (int k = 0; k < 4; ++k) {
      auto row = hn::Zero(d);
      for (int j = 0; j < 4; ++j) {
        const auto value = hn::GatherIndex(d, plane, hn::Add(rows[k], across.index[j]));
        row = hn::MulAdd(across.weights.of[j], value, row);
      }
      sum = hn::MulAdd(down.weights.of[k], row, sum);
    }
    sum = hn::Min(hn::Max(sum, hn::Set(d, low[c])), hn::Set(d, high[c]));
    hn::StoreU(sum, d, out[c]);
  }
}

constexpr int kMaxChannels = 4;

void Remap(
    const Image& image, const float* low, const float* high, const RemapTable& table, Image& out) {
  const size_t count = table.x.size(), lanes = hn::Lanes(FloatTag());
  size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    float* at[kMaxChannels];
    for (int c = 0; c < image.channels; ++c) at[c] = out.Plane(c) + i;
    RemapPixels(image, low, high, table.x.data() + i, table.y.data() + i, at);
  }
  if (i == count) return;
  std::array<float, 16> x = {}, y = {};
  std::copy(table.x.begin() + static_cast<ptrdiff_t>(i), table.x.end(), x.begin());
  std::copy(table.y.begin() + static_cast<ptrdiff_t>(i), table.y.end(), y.begin());
  std::array<std::array<float, 16>, kMaxChannels> last;
  float* at[kMaxChannels];
  for (int c = 0; c < image.channels; ++c) at[c] = last[c].data();
  RemapPixels(image, low, high, x.data(), y.data(), at);
  for (int c = 0; c < image.channels; ++c) {
    std::copy_n(last[c].begin(), count - i, out.Plane(c) + i);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace color3d
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace color3d {

HWY_EXPORT(Remap);

Image CubicRemap(const Image& image, const RemapTable& table) {
  Image out(table.width, table.height, image.channels);
  std::vector<float> low, high;
  for (int c = 0; c < image.channels; ++c) {
    const float* plane = image.Plane(c);
    const auto [smallest, largest] = std::minmax_element(plane, plane + image.PlaneSize());
    low.push_back(*smallest);
    high.push_back(*largest);
  }
  COLOR3D_KERNEL(Remap)(image, low.data(), high.data(), table, out);
  return out;
}

}  // namespace color3d
#endif  // HWY_ONCE
