#include "core/splat/raster/rasterizer.h"

#include <algorithm>

#include "core/base/flush_to_zero.h"
#include "core/simd/instruction_set.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/splat/raster/rasterizer.cc"
#include <hwy/foreach_target.h>

#include "core/splat/raster/ellipse-inl.h"

#ifndef COLOR3D_SPLAT_RASTERIZER_ONCE
#define COLOR3D_SPLAT_RASTERIZER_ONCE
namespace color3d {
namespace {

alignas(64) constexpr float kLaneX[16] = {0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3};
alignas(64) constexpr float kLaneY[16] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};

struct Tile {
  int index;
  int x0, y0;  // first pixel
  uint32_t begin, end;
};

Tile TileAt(const TileLists& lists, int64_t index) {
  Tile t;
  t.index = static_cast<int>(index);
  t.x0 = t.index % lists.tiles_x * kTileSide;
  t.y0 = t.index / lists.tiles_x * kTileSide;
  t.begin = lists.tile_begin[index];
  t.end = lists.tile_begin[index + 1];
  return t;
}

struct ForwardJob {
  const SplatBuffer& splats;
  const TileLists& lists;
  const float* background;
  PlaneBuffer& color;
  PlaneBuffer* transmittance;
  PlaneBuffer* median_depth;
  uint16_t* block_masks;
};

struct BackwardJob {
  const SplatBuffer& splats;
  const TileLists& lists;
  const uint16_t* block_masks;
  const PlaneBuffer& color;
  const PlaneBuffer& d_color;
  float* pair_gradient;
};

}  // namespace
}  // namespace color3d
#endif  // COLOR3D_SPLAT_RASTERIZER_ONCE

HWY_BEFORE_NAMESPACE();
namespace color3d {
namespace HWY_NAMESPACE {
namespace {

using simd::Broadcast;
using simd::I32;
using simd::Mask;

HWY_INLINE F32 LaneX() { return simd::Load(kLaneX); }
HWY_INLINE F32 LaneY() { return simd::Load(kLaneY); }

F32 LoadBlock(const PlaneBuffer& image, int channel, const Tile& tile, int block) {
  alignas(64) float values[16];
  const int x = tile.x0 + block % 4 * 4, y = tile.y0 + block / 4 * 4;
  for (int r = 0; r < 4; ++r) std::copy_n(image.Row(channel, y + r) + x, 4, values + 4 * r);
  return simd::Load(values);
}

void StoreBlock(PlaneBuffer& image, int channel, const Tile& tile, int block, F32 value) {
  alignas(64) float values[16];
  simd::Store(values, value);
  const int x = tile.x0 + block % 4 * 4, y = tile.y0 + block / 4 * 4;
  for (int r = 0; r < 4; ++r) std::copy_n(values + 4 * r, 4, image.Row(channel, y + r) + x);
}

// 1 inside the picture, 0 outside: pixels outside are finished before they begin.
F32 InitialTransmittance(int width, int height, const Tile& tile, int block) {
  const F32 x = LaneX() + static_cast<float>(tile.x0 + block % 4 * 4);
  const F32 y = LaneY() + static_cast<float>(tile.y0 + block / 4 * 4);
  const Mask inside = simd::And(simd::Less(x, Broadcast(static_cast<float>(width))),
                                simd::Less(y, Broadcast(static_cast<float>(height))));
  return simd::SelectOrZero(inside, Broadcast(1.0f));
}

// Sixteen list entries, planar.
struct Chunk {
  alignas(64) float column[kSplatColor + 4][16];
  int count;
};

template <int kChannels>
void LoadChunk(const SplatBuffer& splats, const uint32_t* gaussian, int count, Chunk& chunk) {
  constexpr int kRow = SplatRowFloats(kChannels);
  chunk.count = count;
  for (int j = 0; j < count; ++j) {
    const float* row = splats.rows.data() + static_cast<size_t>(gaussian[j]) * kRow;
    for (int k = 0; k < kSplatColor + kChannels; ++k) chunk.column[k][j] = row[k];
  }
  for (int j = count; j < 16; ++j) {
    for (int k = 0; k < kSplatColor; ++k) chunk.column[k][j] = 1.0f;
  }
}

// Bit b of masks[j]: the ellipse of entry j touches pixel centres of block b.
void BlockMasks(const Chunk& chunk, const Tile& tile, uint16_t* masks) {
  const F32 u = simd::Load(chunk.column[kU]), v = simd::Load(chunk.column[kV]);
  const Ellipse e = MakeEllipse(simd::Load(chunk.column[kInvX]),
                                simd::Load(chunk.column[kSlope]),
                                simd::Load(chunk.column[kInvY]),
                                simd::Load(chunk.column[kLog2Opacity]));
  const F32 reach = e.y_reach + kBoundSlackPx, zero = simd::Zero(), four = Broadcast(4.0f);
  const I32 one = Broadcast(int32_t{1});
  I32 bits = Broadcast(int32_t{0});
  for (int row = 3; row >= 0; --row) {
    const F32 low = (static_cast<float>(tile.y0 + 4 * row) + 0.5f) - v;
    const F32 high = low + 3.0f;
    F32 left, right;
    BandExtent(e, low, high, &left, &right);
    const F32 origin = u - (static_cast<float>(tile.x0) + 0.5f);
    const F32 begin = simd::Clamp((origin + left + 0.999f) * 0.25f, zero, four);
    const F32 end = simd::Clamp((origin + right + 4.0f) * 0.25f, zero, four);
    const I32 first = simd::Truncate(begin);
    const I32 last = simd::Max(simd::Truncate(end), first);  // one past
    const I32 span = simd::ShiftLeft(one, last) - simd::ShiftLeft(one, first);
    const Mask meets = simd::And(simd::Less(low, reach), simd::Less(-reach, high));
    bits = simd::ShiftLeft<4>(bits) | simd::SelectOrZero(meets, span);
  }
  alignas(64) int32_t lanes[16];
  simd::Store(lanes, bits);
  for (int j = 0; j < chunk.count; ++j) masks[j] = static_cast<uint16_t>(lanes[j]);
}

uint32_t AliveBlocks(const F32* transmittance) {
  uint32_t alive = 0;
  for (int b = 0; b < kTileBlocks; ++b) {
    const Mask m = simd::GreaterEqual(transmittance[b], Broadcast(kMinTransmittance));
    alive |= (simd::Any(m) ? 1u : 0u) << b;
  }
  return alive;
}

// The blocks to visit, entry after entry, as 16 * entry + block. One flat list instead of nested
// loops over rows and columns: mispredicted loop exits cost as much as the arithmetic.
struct WorkList {
  int32_t item[16 * kTileBlocks + 16];
  int begin[17];  // of each entry's items
};

void BuildWorkList(const Chunk& chunk, const uint16_t* masks, uint32_t alive, WorkList& work) {
  int count = 0;
  for (int j = 0; j < chunk.count; ++j) {
    work.begin[j] = count;
    const uint32_t mask = masks[j] & alive;
#if HWY_TARGET == HWY_AVX3
    const __m512i first = _mm512_set1_epi32(16 * j);
    const __m512i blocks = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    _mm512_storeu_si512(
        work.item + count,
        _mm512_maskz_compress_epi32(static_cast<__mmask16>(mask), _mm512_add_epi32(first, blocks)));
    count += __builtin_popcount(mask);
#else
    for (uint32_t bits = mask; bits != 0; bits &= bits - 1) {
      work.item[count++] = 16 * j + __builtin_ctz(bits);
    }
#endif
  }
  work.begin[chunk.count] = count;
}

// Terms of the exponent of entry j in block b: e = e_lane[j] + e_block[j][b], dy = LaneY() +
// dy_block[j][b].
struct Offsets {
  F32 e_lane[16];
  alignas(64) float e_block[16][kTileBlocks];
  alignas(64) float dy_block[16][kTileBlocks];
};

void ComputeOffsets(const Chunk& chunk, const Tile& tile, Offsets& o) {
  const F32 block_x = LaneX() * 4.0f, block_y = LaneY() * 4.0f;
  for (int j = 0; j < chunk.count; ++j) {
    const F32 slope = Broadcast(chunk.column[kSlope][j]);
    const F32 dy = block_y + ((static_cast<float>(tile.y0) + 0.5f) - chunk.column[kV][j]);
    const F32 dx = block_x + ((static_cast<float>(tile.x0) + 0.5f) - chunk.column[kU][j]);
    o.e_lane[j] = LaneX() - slope * LaneY();
    simd::Store(o.e_block[j], dx - slope * dy);
    simd::Store(o.dy_block[j], dy);
  }
}

// With kMedian the last channel is depth.
template <int kChannels, bool kMedian>
void ForwardTile(const ForwardJob& job, const Tile& tile) {
  F32 t[kTileBlocks], sum[kChannels][kTileBlocks], median[kMedian ? kTileBlocks : 1];
  for (int b = 0; b < kTileBlocks; ++b) {
    t[b] = InitialTransmittance(job.color.width, job.color.height, tile, b);
    if constexpr (kMedian) median[b] = Broadcast(0.0f);
    for (int c = 0; c < kChannels; ++c) sum[c][b] = Broadcast(0.0f);
  }
  Chunk chunk;
  WorkList work;
  Offsets offsets;
  for (uint32_t begin = tile.begin; begin < tile.end; begin += 16) {
    const int count = static_cast<int>(std::min<uint32_t>(16, tile.end - begin));
    const uint32_t alive = AliveBlocks(t);
    if (alive == 0) break;
    LoadChunk<kChannels>(job.splats, job.lists.gaussian.data() + begin, count, chunk);
    BlockMasks(chunk, tile, job.block_masks + begin);
    BuildWorkList(chunk, job.block_masks + begin, alive, work);
    ComputeOffsets(chunk, tile, offsets);
    for (int k = 0; k < work.begin[count]; ++k) {
      const int j = work.item[k] >> 4, b = work.item[k] & 15;
      const F32 e = offsets.e_lane[j] + offsets.e_block[j][b];
      const F32 dy = LaneY() + offsets.dy_block[j][b];
      const F32 exponent = chunk.column[kLog2Opacity][j] - chunk.column[kInvY][j] * (dy * dy) -
                           chunk.column[kInvX][j] * (e * e);
      const Mask live = simd::And(simd::GreaterEqual(exponent, Broadcast(kLog2MinAlpha)),
                                  simd::GreaterEqual(t[b], Broadcast(kMinTransmittance)));
      const F32 alpha =
          simd::SelectOrZero(live, simd::Min(simd::Exp2(exponent), Broadcast(kMaxAlpha)));
      const F32 weight = alpha * t[b];
      if constexpr (kMedian) {
        const Mask crossed = simd::And(simd::GreaterEqual(t[b], Broadcast(0.5f)),
                                       simd::Less(t[b] - weight, Broadcast(0.5f)));
        median[b] = simd::Select(
            crossed, Broadcast(chunk.column[kSplatColor + kChannels - 1][j]), median[b]);
      }
      t[b] = t[b] - weight;
      for (int c = 0; c < kChannels; ++c) {
        sum[c][b] = sum[c][b] + weight * chunk.column[kSplatColor + c][j];
      }
    }
  }
  for (int b = 0; b < kTileBlocks; ++b) {
    for (int c = 0; c < kChannels; ++c) {
      StoreBlock(job.color, c, tile, b, sum[c][b] + t[b] * job.background[c]);
    }
    if (job.transmittance != nullptr) StoreBlock(*job.transmittance, 0, tile, b, t[b]);
    if constexpr (kMedian) StoreBlock(*job.median_depth, 0, tile, b, median[b]);
  }
}

// State of a tile's pixels, front to back.
template <int kChannels>
struct BackwardPixels {
  F32 t[kTileBlocks];             // transmittance before the next entry
  F32 rest[kTileBlocks];          // dL/dC . (colour still to come)
  F32 d[kChannels][kTileBlocks];  // dL/dC

  BackwardPixels(const PlaneBuffer& color, const PlaneBuffer& d_color, const Tile& tile) {
    for (int b = 0; b < kTileBlocks; ++b) {
      t[b] = InitialTransmittance(color.width, color.height, tile, b);
      rest[b] = Broadcast(0.0f);
      for (int c = 0; c < kChannels; ++c) {
        d[c][b] = LoadBlock(d_color, c, tile, b);
        rest[b] = rest[b] + d[c][b] * LoadBlock(color, c, tile, b);
      }
    }
  }
};

// Processes one entry: writes its gradient row to `out` and advances the pixels behind it.
template <int kChannels>
HWY_INLINE void BackwardEntry(const Chunk& chunk,
                              const Offsets& offsets,
                              const WorkList& work,
                              int j,
                              BackwardPixels<kChannels>& pixels,
                              float* out) {
  constexpr int kColumns = kGradientColor + kChannels;
  F32 w0 = simd::Zero(), we1 = w0, wy1 = w0, wee = w0, wey = w0, wyy = w0, wc[kChannels];
  for (int c = 0; c < kChannels; ++c) wc[c] = simd::Zero();
  const F32 inv_x = Broadcast(chunk.column[kInvX][j]), inv_y = Broadcast(chunk.column[kInvY][j]);
  for (int k = work.begin[j]; k < work.begin[j + 1]; ++k) {
    const int b = work.item[k] & 15;
    const F32 e = offsets.e_lane[j] + offsets.e_block[j][b];
    const F32 dy = LaneY() + offsets.dy_block[j][b];
    const F32 exponent = chunk.column[kLog2Opacity][j] - inv_y * (dy * dy) - inv_x * (e * e);
    const F32 t_before = pixels.t[b];
    const Mask live = simd::And(simd::GreaterEqual(exponent, Broadcast(kLog2MinAlpha)),
                                simd::GreaterEqual(t_before, Broadcast(kMinTransmittance)));
    const F32 alpha =
        simd::SelectOrZero(live, simd::Min(simd::Exp2(exponent), Broadcast(kMaxAlpha)));
    const F32 weight = alpha * t_before;
    F32 dc = pixels.d[0][b] * chunk.column[kSplatColor][j];
    wc[0] = wc[0] + weight * pixels.d[0][b];
    for (int c = 1; c < kChannels; ++c) {
      dc = dc + pixels.d[c][b] * chunk.column[kSplatColor + c][j];
      wc[c] = wc[c] + weight * pixels.d[c][b];
    }
    const F32 gain = dc * weight;
    const F32 left = pixels.rest[b] - gain;
    pixels.rest[b] = left;
    pixels.t[b] = t_before - weight;
    // alpha dL/d(alpha) = alpha (T dc - rest / (1 - alpha)); zero where alpha is capped.
    F32 w = gain - left * alpha * simd::Reciprocal(1.0f - alpha);
    w = simd::SelectOrZero(simd::Less(exponent, Broadcast(kLog2MaxAlpha)), w);
    const F32 we = w * e, wy = w * dy;
    w0 = w0 + w;
    we1 = we1 + we;
    wy1 = wy1 + wy;
    wee = wee + we * e;
    wey = wey + we * dy;
    wyy = wyy + wy * dy;
  }
  F32 sums[kColumns] = {w0, we1, wy1, wee, wey, wyy};
  for (int c = 0; c < kChannels; ++c) sums[kGradientColor + c] = wc[c];
  simd::HorizontalSums<kColumns>(sums, out);
}

template <int kChannels>
void BackwardTile(const BackwardJob& job, const Tile& tile) {
  constexpr int kRow = GradientRowFloats(kChannels);
  BackwardPixels<kChannels> pixels(job.color, job.d_color, tile);
  Chunk chunk;
  WorkList work;
  Offsets offsets;
  uint32_t begin = tile.begin;
  for (; begin < tile.end; begin += 16) {
    const int count = static_cast<int>(std::min<uint32_t>(16, tile.end - begin));
    const uint32_t alive = AliveBlocks(pixels.t);
    if (alive == 0) break;
    LoadChunk<kChannels>(job.splats, job.lists.gaussian.data() + begin, count, chunk);
    BuildWorkList(chunk, job.block_masks + begin, alive, work);
    ComputeOffsets(chunk, tile, offsets);
    for (int j = 0; j < count; ++j) {
      BackwardEntry<kChannels>(
          chunk,
          offsets,
          work,
          j,
          pixels,
          job.pair_gradient + static_cast<size_t>(job.lists.pair[begin + j]) * kRow);
    }
  }
  // Entries behind the last visible surface.
  for (; begin < tile.end; ++begin) {
    std::fill_n(job.pair_gradient + static_cast<size_t>(job.lists.pair[begin]) * kRow, kRow, 0.0f);
  }
}

template <bool kMedian>
void ForwardTileOf(const ForwardJob& job, const Tile& tile) {
  switch (job.splats.channels) {
    case 1:
      return ForwardTile<1, kMedian>(job, tile);
    case 2:
      return ForwardTile<2, kMedian>(job, tile);
    case 3:
      return ForwardTile<3, kMedian>(job, tile);
    default:
      return ForwardTile<4, kMedian>(job, tile);
  }
}

void ForwardTileAt(const ForwardJob& job, int64_t index) {
  const Tile tile = TileAt(job.lists, index);
  if (job.median_depth != nullptr) {
    ForwardTileOf<true>(job, tile);
  } else {
    ForwardTileOf<false>(job, tile);
  }
}

void BackwardTileAt(const BackwardJob& job, int64_t index) {
  const Tile tile = TileAt(job.lists, index);
  switch (job.splats.channels) {
    case 1:
      return BackwardTile<1>(job, tile);
    case 2:
      return BackwardTile<2>(job, tile);
    default:
      return BackwardTile<3>(job, tile);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace color3d
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace color3d {
namespace {
HWY_EXPORT(ForwardTileAt);
HWY_EXPORT(BackwardTileAt);
}  // namespace

void RasterizeForward(const SplatBuffer& splats,
                      const TileLists& lists,
                      const float* background,
                      ThreadPool& pool,
                      const RasterizedPlanes& planes,
                      std::vector<uint16_t>& block_masks) {
  block_masks.resize(lists.pair_count() + 16);
  const ForwardJob job{splats,
                       lists,
                       background,
                       planes.color,
                       planes.transmittance,
                       planes.median_depth,
                       block_masks.data()};
  const auto forward_tile = &COLOR3D_KERNEL(ForwardTileAt);
  pool.ForEach(lists.tile_count(), [&](int64_t index, int) { forward_tile(job, index); });
}

void RasterizeBackward(const SplatBuffer& splats,
                       const TileLists& lists,
                       const std::vector<uint16_t>& block_masks,
                       const PlaneBuffer& color,
                       const PlaneBuffer& d_color,
                       ThreadPool& pool,
                       AlignedFloats& pair_gradient) {
  pair_gradient.resize(lists.pair_count() * GradientRowFloats(splats.channels));
  const BackwardJob job{splats, lists, block_masks.data(), color, d_color, pair_gradient.data()};
  const auto backward_tile = &COLOR3D_KERNEL(BackwardTileAt);
  pool.ForEach(lists.tile_count(), [&](int64_t index, int) {
    const ScopedFlushToZero flush;
    backward_tile(job, index);
  });
}

}  // namespace color3d
#endif  // HWY_ONCE
