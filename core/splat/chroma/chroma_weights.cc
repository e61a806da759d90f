#include "core/splat/chroma/chroma_weights.h"

#include <algorithm>
#include <cmath>

#include "core/simd/instruction_set.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/splat/chroma/chroma_weights.cc"
#include <hwy/foreach_target.h>

#include "core/simd/simd-inl.h"
#include "core/splat/raster/raster_constants.h"

HWY_BEFORE_NAMESPACE();
namespace color3d {
namespace HWY_NAMESPACE {
namespace {

using simd::Broadcast;
using simd::F32;
using simd::Mask;

constexpr float kUnit = 1.0f / 65535.0f;
// Drops entries whose weights sum to less than this many pixels: a twentieth of the entries of real
// scenes, 1e-4 of their light.
constexpr float kMinStoredPixels = 1e-3f;

// Blocks of four cells from `first` to `last` that [center - reach, center + reach] meets.
inline void BlockRange(float center, float reach, float origin, int* first, int* last) {
  const float low = (center - reach - origin - 3.5f) * 0.25f;
  const float high = (center + reach - origin - 0.5f) * 0.25f;
  *first = static_cast<int>(std::ceil(std::clamp(low, 0.0f, 4.0f)));
  *last = static_cast<int>(std::floor(std::clamp(high, -1.0f, 3.0f)));
}

// Gaussians of a tile are scattered in memory: prefetched this many entries ahead.
constexpr size_t kAhead = 12;

// Ranges of blocks of a splat's bounding box.
struct Box {
  int x0, x1, y0, y1;
};
Box BoundingBlocks(const float* row, float tile_x, float tile_y) {
  const float tau = std::max(row[kLog2Opacity] - kLog2MinAlpha, 0.0f);
  const float var_y = 1.0f / row[kInvY];
  const float var_x = 1.0f / row[kInvX] + row[kSlope] * row[kSlope] * var_y;
  float rx = std::sqrt(tau * var_x) + kBoundSlackPx, ry = std::sqrt(tau * var_y) + kBoundSlackPx;
  if (!(rx < 1e6f)) rx = 1e6f;
  if (!(ry < 1e6f)) ry = 1e6f;
  Box box;
  BlockRange(row[kU], rx, tile_x, &box.x0, &box.x1);
  BlockRange(row[kV], ry, tile_y, &box.y0, &box.y1);
  return box;
}

// Adds nothing if all weights are zero.
HWY_INLINE void AddItem(F32 w, int block, std::vector<WeightItem>& items) {
  if (!(simd::HorizontalSum(w) > kUnit)) return;
  WeightItem item;
  simd::StoreU16(item.weight, w * 65535.0f + 0.5f);
  item.block = static_cast<uint32_t>(block);
  items.push_back(item);
}

HWY_INLINE bool AnyAlive(const F32* t) {
  F32 most = t[0];
  for (int b = 1; b < kTileBlocks; ++b) most = simd::Max(most, t[b]);
  return simd::Any(simd::GreaterEqual(most, Broadcast(kMinTransmittance)));
}

void Build(const SplatBuffer& splats,
           const TileLists& lists,
           int tile,
           int width_px,
           int height_px,
           TileWeights& weights) {
  alignas(64) static constexpr float kLaneX[16] = {0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3};
  alignas(64) static constexpr float kLaneY[16] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};
  const F32 lane_x = simd::Load(kLaneX), lane_y = simd::Load(kLaneY);
  weights.Clear();
  const float x0 = static_cast<float>(tile % lists.tiles_x * kTileSide);
  const float y0 = static_cast<float>(tile / lists.tiles_x * kTileSide);
  F32 t[kTileBlocks];
  for (int b = 0; b < kTileBlocks; ++b) {
    const F32 x = lane_x + (x0 + static_cast<float>(b % 4 * 4));
    const F32 y = lane_y + (y0 + static_cast<float>(b / 4 * 4));
    const Mask inside = simd::And(simd::Less(x, Broadcast(static_cast<float>(width_px))),
                                  simd::Less(y, Broadcast(static_cast<float>(height_px))));
    t[b] = simd::SelectOrZero(inside, Broadcast(1.0f));
  }
  const uint32_t begin = lists.tile_begin[tile], end = lists.tile_begin[tile + 1];
  for (uint32_t k = begin; k < end; ++k) {
    if ((k - begin) % 16 == 0 && !AnyAlive(t)) break;
    const uint32_t gaussian = lists.gaussian[k];
    const float* row = splats.rows.data() + static_cast<size_t>(gaussian) * splats.row_floats;
    const Box box = BoundingBlocks(row, x0, y0);
    const float inv_x = row[kInvX], slope = row[kSlope], inv_y = row[kInvY];
    F32 total = simd::Zero();
    for (int b = 4 * box.y0; b <= 4 * box.y1; b += 4) {
      for (int i = b + box.x0; i <= b + box.x1; ++i) {
        const F32 dx = lane_x + ((x0 + static_cast<float>(i % 4 * 4) + 0.5f) - row[kU]);
        const F32 dy = lane_y + ((y0 + static_cast<float>(b) + 0.5f) - row[kV]);
        const F32 e = dx - slope * dy;
        const F32 exponent = row[kLog2Opacity] - inv_y * (dy * dy) - inv_x * (e * e);
        const Mask live = simd::And(simd::GreaterEqual(exponent, Broadcast(kLog2MinAlpha)),
                                    simd::GreaterEqual(t[i], Broadcast(kMinTransmittance)));
        const F32 alpha =
            simd::SelectOrZero(live, simd::Min(simd::Exp2(exponent), Broadcast(kMaxAlpha)));
        const F32 w = alpha * t[i];
        t[i] = t[i] - w;
        total = total + w;
        AddItem(w, i, weights.items);
      }
    }
    if (!(simd::HorizontalSum(total) >= kMinStoredPixels)) {
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
      const F32 w = simd::LoadU16(item->weight);
      float* p = picture + 2 * kBlockPixels * item->block;
      simd::Store(p, simd::Load(p) + w * a);
      simd::Store(p + kBlockPixels, simd::Load(p + kBlockPixels) + w * b);
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
    F32 a = simd::Zero(), b = simd::Zero();
    for (const WeightItem* end = weights.items.data() + weights.first_item[j + 1]; item < end;
         ++item) {
      F32 w = simd::LoadU16(item->weight) * kUnit;
      if (kSquared) w = w * w;
      const float* p = picture + 2 * kBlockPixels * item->block;
      a = a + w * simd::Load(p);
      b = b + w * simd::Load(p + kBlockPixels);
    }
    float* s = sum + 2 * static_cast<size_t>(gaussian[j]);
    s[0] += simd::HorizontalSum(a);
    s[1] += simd::HorizontalSum(b);
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
