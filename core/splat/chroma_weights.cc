#include "core/splat/chroma_weights.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/splat/instruction_set.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/splat/chroma_weights.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace color3d {
namespace HWY_NAMESPACE {
namespace {

// Sixteen lanes of the compiler's own vectors, split where registers are narrower: simd-inl.h has
// no 16-bit numbers.
using F32 = float __attribute__((vector_size(64)));
using I32 = int32_t __attribute__((vector_size(64)));
using U16 = uint16_t __attribute__((vector_size(32)));

constexpr float kUnit = 1.0f / 65535.0f;
// Entries whose weights sum to less than this many pixels are left out: a twentieth of the entries
// of real scenes, 1e-4 of their light.
constexpr float kMinStoredPixels = 1e-3f;
constexpr float kLog2MinAlpha = -7.9943534f;
constexpr float kSlackPx = 0.02f;  // the pixel test itself decides

template <class V, class T>
inline V LoadAs(const T* p) {
  V v;
  std::memcpy(&v, p, sizeof(v));
  return v;
}
inline F32 LoadWeights(const WeightItem& item) {
  return __builtin_convertvector(__builtin_convertvector(LoadAs<U16>(item.weight), I32), F32);
}
inline void Store(float* p, F32 v) { std::memcpy(p, &v, sizeof(v)); }

inline float Sum(F32 v) {
  using Half = float __attribute__((vector_size(32)));
  using Quarter = float __attribute__((vector_size(16)));
  Half h[2];
  std::memcpy(h, &v, sizeof(v));
  const Half a = h[0] + h[1];
  Quarter q[2];
  std::memcpy(q, &a, sizeof(a));
  const Quarter b = q[0] + q[1];
  return (b[0] + b[2]) + (b[1] + b[3]);
}

// 2^x for x in [-126, 1]: as simd::Exp2.
inline F32 Exp2(F32 x) {
  const F32 shifted = x + 12582912.0f;
  const F32 f = x - (shifted - 12582912.0f);
  F32 p = f * 1.3390863e-3f + 9.6760319e-3f;
  p = p * f + 5.5503571e-2f;
  p = p * f + 2.4022107e-1f;
  p = p * f + 6.9314719e-1f;
  p = p * f + 1.0000001f;
  I32 bits = LoadAs<I32>(&p) + (LoadAs<I32>(&shifted) << 23);
  return LoadAs<F32>(&bits);
}

// Blocks of four cells from `first` to `last` that [center - reach, center + reach] meets.
inline void BlockRange(float center, float reach, float origin, int* first, int* last) {
  const float low = (center - reach - origin - 3.5f) * 0.25f;
  const float high = (center + reach - origin - 0.5f) * 0.25f;
  *first = static_cast<int>(std::ceil(std::clamp(low, 0.0f, 4.0f)));
  *last = static_cast<int>(std::floor(std::clamp(high, -1.0f, 3.0f)));
}

// Gaussians of a tile lie anywhere in memory: fetched this many entries ahead.
constexpr size_t kAhead = 12;

// Ranges of blocks of a splat's bounding box.
struct Box {
  int x0, x1, y0, y1;
};
Box BoundingBlocks(const float* row, float tile_x, float tile_y) {
  const float tau = std::max(row[kLog2Opacity] - kLog2MinAlpha, 0.0f);
  const float var_y = 1.0f / row[kInvY];
  const float var_x = 1.0f / row[kInvX] + row[kSlope] * row[kSlope] * var_y;
  float rx = std::sqrt(tau * var_x) + kSlackPx, ry = std::sqrt(tau * var_y) + kSlackPx;
  if (!(rx < 1e6f)) rx = 1e6f;
  if (!(ry < 1e6f)) ry = 1e6f;
  Box box;
  BlockRange(row[kU], rx, tile_x, &box.x0, &box.x1);
  BlockRange(row[kV], ry, tile_y, &box.y0, &box.y1);
  return box;
}

// Nothing when all weights are zero.
inline void AddItem(F32 w, int block, std::vector<WeightItem>& items) {
  if (!(Sum(w) > 1.0f / 65535.0f)) return;
  WeightItem item;
  const U16 q = __builtin_convertvector(__builtin_convertvector(w * 65535.0f + 0.5f, I32), U16);
  std::memcpy(item.weight, &q, sizeof(q));
  item.block = static_cast<uint32_t>(block);
  items.push_back(item);
}

bool AnyAlive(const F32* t) {
  F32 most = t[0];
  for (int b = 1; b < kTileBlocks; ++b) most = most > t[b] ? most : t[b];
  for (int lane = 0; lane < kBlockPixels; ++lane) {
    if (most[lane] >= kMinTransmittance) return true;
  }
  return false;
}

void Build(const SplatBuffer& splats,
           const TileLists& lists,
           int tile,
           int width_px,
           int height_px,
           TileWeights& weights) {
  const F32 lane_x = {0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3};
  const F32 lane_y = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};
  const F32 zero = {}, one = zero + 1.0f;
  weights.Clear();
  const float x0 = static_cast<float>(tile % lists.tiles_x * kTileSide);
  const float y0 = static_cast<float>(tile / lists.tiles_x * kTileSide);
  F32 t[kTileBlocks];
  for (int b = 0; b < kTileBlocks; ++b) {
    const F32 x = lane_x + (x0 + static_cast<float>(b % 4 * 4));
    const F32 y = lane_y + (y0 + static_cast<float>(b / 4 * 4));
    const I32 inside = (x < static_cast<float>(width_px)) & (y < static_cast<float>(height_px));
    t[b] = inside ? one : zero;
  }
  const uint32_t begin = lists.tile_begin[tile], end = lists.tile_begin[tile + 1];
  for (uint32_t k = begin; k < end; ++k) {
    if ((k - begin) % 16 == 0 && !AnyAlive(t)) break;
    const uint32_t gaussian = lists.gaussian[k];
    const float* row = splats.rows.data() + static_cast<size_t>(gaussian) * splats.row_floats;
    const Box box = BoundingBlocks(row, x0, y0);
    const float inv_x = row[kInvX], slope = row[kSlope], inv_y = row[kInvY];
    F32 total = zero;
    for (int b = 4 * box.y0; b <= 4 * box.y1; b += 4) {
      for (int i = b + box.x0; i <= b + box.x1; ++i) {
        const F32 dx = lane_x + ((x0 + static_cast<float>(i % 4 * 4) + 0.5f) - row[kU]);
        const F32 dy = lane_y + ((y0 + static_cast<float>(b) + 0.5f) - row[kV]);
        const F32 e = dx - slope * dy;
        const F32 exponent = row[kLog2Opacity] - inv_y * (dy * dy) - inv_x * (e * e);
        const I32 live = (exponent >= kLog2MinAlpha) & (t[i] >= kMinTransmittance);
        const F32 alpha = Exp2(live ? exponent : zero - 20.0f);
        const F32 w = live ? (alpha < kMaxAlpha ? alpha : zero + kMaxAlpha) * t[i] : zero;
        t[i] = t[i] - w;
        total += w;
        AddItem(w, i, weights.items);
      }
    }
    if (!(Sum(total) >= kMinStoredPixels)) {
      weights.items.resize(weights.first_item.back());
      continue;
    }
    weights.gaussian.push_back(gaussian);
    weights.first_item.push_back(static_cast<uint32_t>(weights.items.size()));
  }
}

void Forward(const TileWeights& weights, const float* value, float* picture) {
  std::fill_n(picture, 2 * kTilePixels, 0.0f);
  const uint32_t* gaussian = weights.gaussian.data();
  const size_t count = weights.gaussian.size();
  const WeightItem* item = weights.items.data();
  for (size_t j = 0; j < count; ++j) {
    if (j + kAhead < count)
      __builtin_prefetch(value + 2 * static_cast<size_t>(gaussian[j + kAhead]));
    const float* v = value + 2 * static_cast<size_t>(gaussian[j]);
    const float a = v[0] * kUnit, b = v[1] * kUnit;
    for (const WeightItem* end = weights.items.data() + weights.first_item[j + 1]; item < end;
         ++item) {
      const F32 w = LoadWeights(*item);
      float* p = picture + 2 * kBlockPixels * item->block;
      Store(p, LoadAs<F32>(p) + w * a);
      Store(p + kBlockPixels, LoadAs<F32>(p + kBlockPixels) + w * b);
    }
  }
}

// sum += V^T picture with V the weights or, squared, their squares.
template <bool kSquared>
void Adjoint(const TileWeights& weights, const float* picture, float* sum) {
  const uint32_t* gaussian = weights.gaussian.data();
  const size_t count = weights.gaussian.size();
  const WeightItem* item = weights.items.data();
  for (size_t j = 0; j < count; ++j) {
    if (j + kAhead < count) {
      __builtin_prefetch(sum + 2 * static_cast<size_t>(gaussian[j + kAhead]), 1);
    }
    F32 a = {}, b = {};
    for (const WeightItem* end = weights.items.data() + weights.first_item[j + 1]; item < end;
         ++item) {
      F32 w = LoadWeights(*item) * kUnit;
      if (kSquared) w = w * w;
      const float* p = picture + 2 * kBlockPixels * item->block;
      a += w * LoadAs<F32>(p);
      b += w * LoadAs<F32>(p + kBlockPixels);
    }
    float* s = sum + 2 * static_cast<size_t>(gaussian[j]);
    s[0] += Sum(a);
    s[1] += Sum(b);
  }
}

void AdjointOfWeights(const TileWeights& weights, const float* picture, float* sum) {
  Adjoint<false>(weights, picture, sum);
}

void AdjointOfSquares(const TileWeights& weights, const float* picture, float* sum) {
  Adjoint<true>(weights, picture, sum);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace color3d
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace color3d {
namespace {
HWY_EXPORT(Build);
HWY_EXPORT(Forward);
HWY_EXPORT(AdjointOfWeights);
HWY_EXPORT(AdjointOfSquares);
}  // namespace

void TileWeights::Clear() {
  gaussian.clear();
  first_item.assign(1, 0);
  items.clear();
}

int64_t TileWeights::Bytes() const {
  return static_cast<int64_t>(sizeof(uint32_t) * (gaussian.size() + first_item.size()) +
                              sizeof(WeightItem) * items.size());
}

void BuildTileWeights(const SplatBuffer& splats,
                      const TileLists& lists,
                      int tile,
                      int width_px,
                      int height_px,
                      TileWeights& weights) {
  COLOR3D_KERNEL(Build)(splats, lists, tile, width_px, height_px, weights);
}

void TileForward(const TileWeights& weights, const float* value, float* picture) {
  COLOR3D_KERNEL(Forward)(weights, value, picture);
}

void TileAdjoint(const TileWeights& weights, const float* picture, float* sum) {
  COLOR3D_KERNEL(AdjointOfWeights)(weights, picture, sum);
}

void TileSquares(const TileWeights& weights, const float* picture, float* sum) {
  COLOR3D_KERNEL(AdjointOfSquares)(weights, picture, sum);
}

}  // namespace color3d
#endif  // HWY_ONCE
