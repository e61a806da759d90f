#include "core/splat/chroma_weights.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace color3d {
namespace {

// Sixteen lanes; the compiler splits them where registers are narrower.
using F32 = float __attribute__((vector_size(64)));
using I32 = int32_t __attribute__((vector_size(64)));
using U16 = uint16_t __attribute__((vector_size(32)));

constexpr float kUnit = 1.0f / 65535.0f;
// Blocks whose weights all stay below this (2e-4) are left out: they hold a fifth of the items and
// a thousandth of the light.
constexpr uint16_t kMinStored = 13;
constexpr float kLog2MinAlpha = -7.9943534f;
constexpr float kSlackPx = 0.02f;  // the pixel test itself decides

template <class V, class T>
inline V LoadAs(const T* p) {
  V v;
  std::memcpy(&v, p, sizeof(v));
  return v;
}
inline F32 LoadWeights(const uint16_t* p) {
  return __builtin_convertvector(__builtin_convertvector(LoadAs<U16>(p), I32), F32);
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

bool AnyAlive(const F32* t) {
  F32 most = t[0];
  for (int b = 1; b < kFineBlocks; ++b) most = most > t[b] ? most : t[b];
  for (int lane = 0; lane < kBlockCells; ++lane) {
    if (most[lane] >= kMinTransmittance) return true;
  }
  return false;
}

}  // namespace

void TileWeights::Clear() {
  gaussian.clear();
  first_item.assign(1, 0);
  block.clear();
  weight.clear();
}

int64_t TileWeights::Bytes() const {
  return static_cast<int64_t>(4 * (gaussian.size() + first_item.size()) + block.size() +
                              2 * weight.size());
}

void BuildTileWeights(const SplatBuffer& splats,
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
  F32 t[kFineBlocks];
  for (int b = 0; b < kFineBlocks; ++b) {
    const F32 x = lane_x + (x0 + static_cast<float>(b % 4 * 4));
    const F32 y = lane_y + (y0 + static_cast<float>(b / 4 * 4));
    const I32 inside =
        (x < static_cast<float>(width_px)) & (y < static_cast<float>(height_px));
    t[b] = inside ? one : zero;
  }
  const uint32_t begin = lists.tile_begin[tile], end = lists.tile_begin[tile + 1];
  for (uint32_t k = begin; k < end; ++k) {
    if ((k - begin) % 16 == 0 && !AnyAlive(t)) break;
    const uint32_t gaussian = lists.gaussian[k];
    const float* row = splats.rows.data() + static_cast<size_t>(gaussian) * splats.row_floats;
    const Box box = BoundingBlocks(row, x0, y0);
    const float inv_x = row[kInvX], slope = row[kSlope], inv_y = row[kInvY];
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
        const I32 rounded = __builtin_convertvector(w * 65535.0f + 0.5f, I32);
        const U16 q = __builtin_convertvector(rounded, U16);
        const U16 large = q >= kMinStored;
        uint64_t any[4];
        std::memcpy(any, &large, sizeof(any));
        if ((any[0] | any[1] | any[2] | any[3]) == 0) continue;
        uint16_t values[16];
        std::memcpy(values, &q, sizeof(values));
        weights.block.push_back(static_cast<uint8_t>(i));
        weights.weight.insert(weights.weight.end(), values, values + 16);
      }
    }
    if (weights.block.size() == weights.first_item.back()) continue;
    weights.gaussian.push_back(gaussian);
    weights.first_item.push_back(static_cast<uint32_t>(weights.block.size()));
  }
}

void CoarsenTileWeights(const TileWeights& fine, const float* pixel_weight, TileWeights& coarse) {
  coarse.Clear();
  F32 share[kFineBlocks];  // of each pixel in its cell
  for (int b = 0; b < kFineBlocks; ++b) {
    const F32 w = LoadAs<F32>(pixel_weight + kBlockCells * b);
    const float total = Sum(w);
    share[b] = w * (total > 0.0f ? 1.0f / total : 0.0f);
  }
  for (size_t j = 0; j < fine.gaussian.size(); ++j) {
    uint16_t cells[kBlockCells] = {};
    bool any = false;
    for (uint32_t item = fine.first_item[j]; item < fine.first_item[j + 1]; ++item) {
      const int b = fine.block[item];
      const F32 w = LoadWeights(fine.weight.data() + kBlockCells * static_cast<size_t>(item));
      cells[b] = static_cast<uint16_t>(std::min(Sum(w * share[b]) + 0.5f, 65535.0f));
      any = any || cells[b] != 0;
    }
    if (!any) continue;
    coarse.gaussian.push_back(fine.gaussian[j]);
    coarse.block.push_back(0);
    coarse.weight.insert(coarse.weight.end(), cells, cells + kBlockCells);
    coarse.first_item.push_back(static_cast<uint32_t>(coarse.block.size()));
  }
}

void TileForward(const TileWeights& weights, int blocks, const float* value, float* picture) {
  std::fill_n(picture, 2 * kBlockCells * blocks, 0.0f);
  for (size_t j = 0; j < weights.gaussian.size(); ++j) {
    const float* v = value + 2 * static_cast<size_t>(weights.gaussian[j]);
    const float a = v[0] * kUnit, b = v[1] * kUnit;
    for (uint32_t item = weights.first_item[j]; item < weights.first_item[j + 1]; ++item) {
      const F32 w = LoadWeights(weights.weight.data() + kBlockCells * static_cast<size_t>(item));
      float* p = picture + 2 * kBlockCells * weights.block[item];
      Store(p, LoadAs<F32>(p) + w * a);
      Store(p + kBlockCells, LoadAs<F32>(p + kBlockCells) + w * b);
    }
  }
}

void TileAdjoint(const TileWeights& weights, const float* picture, float* sum) {
  for (size_t j = 0; j < weights.gaussian.size(); ++j) {
    F32 a = {}, b = {};
    for (uint32_t item = weights.first_item[j]; item < weights.first_item[j + 1]; ++item) {
      const F32 w = LoadWeights(weights.weight.data() + kBlockCells * static_cast<size_t>(item));
      const float* p = picture + 2 * kBlockCells * weights.block[item];
      a += w * LoadAs<F32>(p);
      b += w * LoadAs<F32>(p + kBlockCells);
    }
    float* s = sum + 2 * static_cast<size_t>(weights.gaussian[j]);
    s[0] += kUnit * Sum(a);
    s[1] += kUnit * Sum(b);
  }
}

void TileSquares(const TileWeights& weights, const float* picture, float* sum) {
  for (size_t j = 0; j < weights.gaussian.size(); ++j) {
    F32 a = {}, b = {};
    for (uint32_t item = weights.first_item[j]; item < weights.first_item[j + 1]; ++item) {
      const F32 q = LoadWeights(weights.weight.data() + kBlockCells * static_cast<size_t>(item));
      const F32 w = q * q;
      const float* p = picture + 2 * kBlockCells * weights.block[item];
      a += w * LoadAs<F32>(p);
      b += w * LoadAs<F32>(p + kBlockCells);
    }
    float* s = sum + 2 * static_cast<size_t>(weights.gaussian[j]);
    s[0] += kUnit * kUnit * Sum(a);
    s[1] += kUnit * kUnit * Sum(b);
  }
}

}  // namespace color3d
