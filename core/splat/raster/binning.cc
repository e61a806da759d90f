#include "core/splat/raster/binning.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <utility>

#include "core/base/error.h"
#include "core/simd/instruction_set.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/splat/raster/binning.cc"
#include <hwy/foreach_target.h>

#include "core/splat/raster/ellipse-inl.h"

#ifndef COLOR3D_SPLAT_BINNING_ONCE
#define COLOR3D_SPLAT_BINNING_ONCE
namespace color3d {
namespace {

struct SpanRequest {
  alignas(64) float column[kSplatColor][16];
  alignas(64) float visible[16];  // 1 or 0
  int width, tiles_x, tiles_y;
};
struct SpanResult {
  alignas(64) int32_t first_row[16];
  alignas(64) int32_t row_count[16];
  int32_t* begin;  // [row of tiles][lane]
  int32_t* end;
};

}  // namespace
}  // namespace color3d
#endif  // COLOR3D_SPLAT_BINNING_ONCE

HWY_BEFORE_NAMESPACE();
namespace color3d {
namespace HWY_NAMESPACE {
namespace {

using simd::Broadcast;
using simd::I32;
using simd::Mask;

// The tile rows and, row by row, the tile columns that sixteen Gaussians reach. Returns the most
// rows that one of them has.
int SpansOfSixteen(const SpanRequest& request, SpanResult& result) {
  const F32 u = simd::Load(request.column[kU]), v = simd::Load(request.column[kV]);
  const Ellipse e = MakeEllipse(simd::Load(request.column[kInvX]),
                                simd::Load(request.column[kSlope]),
                                simd::Load(request.column[kInvY]),
                                simd::Load(request.column[kLog2Opacity]));
  constexpr float kPerTile = 1.0f / kTileSide;
  const F32 zero = simd::Zero();
  const F32 tiles_x = Broadcast(static_cast<float>(request.tiles_x));
  const F32 tiles_y = Broadcast(static_cast<float>(request.tiles_y));
  // Pixel centres are at +0.5: pixels i with low <= i <= high lie inside; ceil(low) as trunc of
  // low + (1 - tiny) after clamping.
  const F32 top = v - e.y_reach - (0.5f + kBoundSlackPx) + 0.999f;
  const F32 bottom = v + e.y_reach - (0.5f - kBoundSlackPx);
  const I32 first_row = simd::Truncate(simd::Clamp(top * kPerTile, zero, tiles_y));
  const I32 end_row = simd::Truncate(simd::Clamp(bottom * kPerTile + 1.0f, zero, tiles_y));
  const Mask shown = simd::Less(Broadcast(0.5f), simd::Load(request.visible));
  simd::Store(result.first_row, first_row);
  simd::Store(result.row_count,
              simd::SelectOrZero(shown, simd::Max(end_row, first_row) - first_row));
  int most = 0;
  for (int lane = 0; lane < simd::kLanes; ++lane) most = std::max(most, result.row_count[lane]);
  const F32 last_pixel = Broadcast(static_cast<float>(request.width - 1));
  const F32 first_y = simd::ToFloat(first_row) * static_cast<float>(kTileSide) + 0.5f - v;
  for (int k = 0; k < most; ++k) {
    const F32 y0 = first_y + static_cast<float>(k * kTileSide);
    F32 left, right;
    BandExtent(e, y0, y0 + static_cast<float>(kTileSide - 1), &left, &right);
    left = u + left - 0.5f + 0.999f;
    right = simd::Min(u + right - 0.5f, last_pixel);
    const I32 begin = simd::Truncate(simd::Clamp(left * kPerTile, zero, tiles_x));
    const I32 end = simd::Truncate(simd::Clamp(right * kPerTile + 1.0f, zero, tiles_x));
    simd::Store(result.begin + k * simd::kLanes, begin);
    simd::Store(result.end + k * simd::kLanes, simd::Max(begin, end));
  }
  return most;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace color3d
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace color3d {
namespace {
HWY_EXPORT(SpansOfSixteen);
}  // namespace

void TileBinner::FindSpans(const SplatBuffer& splats,
                           int width,
                           int64_t begin,
                           int64_t end,
                           int thread,
                           TileLists& lists) {
  const auto spans_of_sixteen = &COLOR3D_KERNEL(SpansOfSixteen);
  // Taken out while it grows: the threads' vectors share a cache line.
  std::vector<Span> spans = std::move(spans_[thread]);
  spans.clear();
  std::vector<int32_t> columns(static_cast<size_t>(lists.tiles_y) * 32);
  SpanRequest request;
  request.width = width;
  request.tiles_x = lists.tiles_x;
  request.tiles_y = lists.tiles_y;
  SpanResult result;
  result.begin = columns.data();
  result.end = columns.data() + static_cast<size_t>(lists.tiles_y) * 16;
  for (int64_t first = begin; first < end; first += 16) {
    const int lanes = static_cast<int>(std::min<int64_t>(16, end - first));
    for (int lane = 0; lane < 16; ++lane) {
      const bool drawn = lane < lanes && splats.depth_key[first + lane] != 0;
      request.visible[lane] = drawn ? 1.0f : 0.0f;
      const float* s = splats.rows.data() + (first + lane) * splats.row_floats;
      for (int k = 0; k < kSplatColor; ++k) request.column[k][lane] = drawn ? s[k] : 1.0f;
    }
    spans_of_sixteen(request, result);
    for (int lane = 0; lane < lanes; ++lane) {
      uint32_t pairs = 0;
      rows_[first + lane] = {static_cast<uint32_t>(spans.size()),
                             static_cast<uint16_t>(result.first_row[lane]),
                             static_cast<uint16_t>(result.row_count[lane]),
                             static_cast<uint16_t>(thread)};
      for (int k = 0; k < result.row_count[lane]; ++k) {
        const int32_t from = result.begin[k * 16 + lane], to = result.end[k * 16 + lane];
        pairs += static_cast<uint32_t>(to - from);
        spans.push_back({static_cast<uint16_t>(from), static_cast<uint16_t>(to)});
      }
      lists.first_pair[first + lane + 1] = pairs;
    }
  }
  spans_[thread] = std::move(spans);
}

// The visible Gaussians in index order, each as (key << 32 | index), and the keys' range.
void TileBinner::ListVisible(const SplatBuffer& splats, ThreadPool& pool) {
  const int64_t count = static_cast<int64_t>(splats.depth_key.size());
  pieces_.assign(pool.thread_count(), {});
  pool.ForRanges(count, [&](int64_t begin, int64_t end, int thread) {
    Piece piece;
    for (int64_t i = begin; i < end; ++i) {
      const uint32_t key = splats.depth_key[i];
      if (key == 0) continue;
      ++piece.count;
      piece.low = std::min(piece.low, key);
      piece.high = std::max(piece.high, key);
    }
    pieces_[thread] = piece;
  });
  size_t visible = 0;
  low_key_ = std::numeric_limits<uint32_t>::max();
  high_key_ = 0;
  for (Piece& piece : pieces_) {
    piece.first = visible;
    visible += piece.count;
    low_key_ = std::min(low_key_, piece.low);
    high_key_ = std::max(high_key_, piece.high);
  }
  order_.resize(visible);
  order_scratch_.resize(visible);
  pool.ForRanges(count, [&](int64_t begin, int64_t end, int thread) {
    size_t to = pieces_[thread].first;
    for (int64_t i = begin; i < end; ++i) {
      const uint32_t key = splats.depth_key[i];
      if (key != 0) order_[to++] = uint64_t{key} << 32 | static_cast<uint64_t>(i);
    }
  });
}

// Radix sort, least significant digit first, of the bits that differ. Each thread takes a
// contiguous piece and a digit's pieces keep their order: stable, so ties keep the index order,
// for every thread count.
void TileBinner::SortByDepth(ThreadPool& pool) {
  constexpr int kMostDigitBits = 14;
  constexpr int64_t kWorthSharing = 250'000;  // fewer would share every cache line they write
  if (order_.size() < 2) return;
  const int bits = std::bit_width(high_key_ - low_key_);
  const int passes = (bits + kMostDigitBits - 1) / kMostDigitBits;
  const int digit_bits = passes == 0 ? 0 : (bits + passes - 1) / passes;
  const size_t digits = size_t{1} << digit_bits;
  const int64_t visible = static_cast<int64_t>(order_.size());
  const bool alone = visible < kWorthSharing;
  const int threads = alone ? 1 : pool.thread_count();
  const auto for_pieces = [&](auto&& body) {
    alone ? body(0, visible, 0) : pool.ForRanges(visible, body);
  };
  for (int pass = 0; pass < passes; ++pass) {
    const auto digit_of = [&](uint64_t entry) {
      return (static_cast<uint32_t>(entry >> 32) - low_key_) >> (pass * digit_bits) & (digits - 1);
    };
    chunk_counts_.assign(digits * threads, 0);
    for_pieces([&](int64_t begin, int64_t end, int thread) {
      uint32_t* counts = chunk_counts_.data() + digits * thread;
      for (int64_t i = begin; i < end; ++i) ++counts[digit_of(order_[i])];
    });
    uint32_t sum = 0;
    for (size_t digit = 0; digit < digits; ++digit) {
      for (int t = 0; t < threads; ++t) {
        sum += std::exchange(chunk_counts_[digits * t + digit], sum);
      }
    }
    for_pieces([&](int64_t begin, int64_t end, int thread) {
      uint32_t* next = chunk_counts_.data() + digits * thread;
      for (int64_t i = begin; i < end; ++i) order_scratch_[next[digit_of(order_[i])]++] = order_[i];
    });
    order_.swap(order_scratch_);
  }
}

// Counting sort into tiles that keeps the depth order: each thread takes a contiguous piece of it.
void TileBinner::FillLists(ThreadPool& pool, TileLists& lists) {
  const size_t tiles = static_cast<size_t>(lists.tile_count());
  const int threads = pool.thread_count();
  chunk_counts_.assign(tiles * threads, 0);
  footprints_.resize(order_.size());
  const auto for_each_tile = [&](const Footprint& f, auto&& visit) {
    uint32_t pair = f.first_pair;
    for (int r = 0; r < f.rows; ++r) {
      const uint32_t base = static_cast<uint32_t>((f.first_row + r) * lists.tiles_x);
      for (uint32_t x = f.spans[r].begin; x < f.spans[r].end; ++x) {
        visit(base + x, f.gaussian, pair++);
      }
    }
  };
  const int64_t visible = static_cast<int64_t>(order_.size());
  pool.ForRanges(visible, [&](int64_t begin, int64_t end, int thread) {
    uint32_t* counts = chunk_counts_.data() + tiles * thread;
    for (int64_t k = begin; k < end; ++k) {
      if (k + 16 < end) __builtin_prefetch(&rows_[static_cast<uint32_t>(order_[k + 16])]);
      if (k + 8 < end) {
        const RowRange& soon = rows_[static_cast<uint32_t>(order_[k + 8])];
        __builtin_prefetch(spans_[soon.owner].data() + soon.first_span);
      }
      const uint32_t gaussian = static_cast<uint32_t>(order_[k]);
      const RowRange& rows = rows_[gaussian];
      footprints_[k] = {spans_[rows.owner].data() + rows.first_span,
                        gaussian,
                        lists.first_pair[gaussian],
                        rows.first_row,
                        rows.rows};
      for_each_tile(footprints_[k], [&](uint32_t tile, uint32_t, uint32_t) { ++counts[tile]; });
    }
  });
  uint32_t sum = 0;
  for (size_t tile = 0; tile < tiles; ++tile) {
    lists.tile_begin[tile] = sum;
    for (int t = 0; t < threads; ++t) sum += std::exchange(chunk_counts_[tiles * t + tile], sum);
  }
  lists.tile_begin[tiles] = sum;
  pool.ForRanges(visible, [&](int64_t begin, int64_t end, int thread) {
    uint32_t* next = chunk_counts_.data() + tiles * thread;
    for (int64_t k = begin; k < end; ++k) {
      if (k + 8 < end) __builtin_prefetch(footprints_[k + 8].spans);
      for_each_tile(footprints_[k], [&](uint32_t tile, uint32_t gaussian, uint32_t pair) {
        const uint32_t to = next[tile]++;
        lists.gaussian[to] = gaussian;
        lists.pair[to] = pair;
      });
    }
  });
}

void TileBinner::Bin(
    const SplatBuffer& splats, int width, int height, ThreadPool& pool, TileLists& lists) {
  lists.tiles_x = (width + kTileSide - 1) / kTileSide;
  lists.tiles_y = (height + kTileSide - 1) / kTileSide;
  const int64_t count = static_cast<int64_t>(splats.depth_key.size());
  spans_.resize(pool.thread_count());
  rows_.resize(count);
  lists.first_pair.assign(count + 1, 0);
  lists.tile_begin.assign(lists.tile_count() + 1, 0);
  pool.ForRanges(count, [&](int64_t begin, int64_t end, int thread) {
    FindSpans(splats, width, begin, end, thread, lists);
  });
  uint64_t total = 0;
  for (int64_t i = 1; i <= count; ++i) {
    total += lists.first_pair[i];
    lists.first_pair[i] = static_cast<uint32_t>(total);
  }
  if (total > static_cast<uint64_t>(std::numeric_limits<int32_t>::max())) {
    throw Error(
        ErrorCode::kResourceExhausted,
        "the Gaussians cover {} (tile, Gaussian) pairs, more than 2^31; use fewer or smaller "
        "Gaussians, or a smaller picture",
        total);
  }
  lists.gaussian.resize(total);
  lists.pair.resize(total);
  ListVisible(splats, pool);
  SortByDepth(pool);
  FillLists(pool, lists);
}

}  // namespace color3d
#endif  // HWY_ONCE
