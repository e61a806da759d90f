// Assignment of splats to 16x16 tiles, front to back. Internal to the splat module. The result does
// not depend on the thread count.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "core/base/parallel.h"
#include "core/splat/raster/projection.h"
#include "core/splat/raster/raster_constants.h"

namespace color3d {

struct TileLists {
  int tiles_x = 0;
  int tiles_y = 0;
  // Entries of tile t: [tile_begin[t], tile_begin[t + 1]), by depth, ties by Gaussian index.
  std::vector<uint32_t> tile_begin;
  std::vector<uint32_t> gaussian;
  std::vector<uint32_t> pair;        // index of this entry's gradient row
  std::vector<uint32_t> first_pair;  // count + 1; Gaussian i owns pairs [first_pair[i], [i + 1])

  int tile_count() const { return tiles_x * tiles_y; }
  size_t pair_count() const { return gaussian.size(); }
};

// Reused between calls to avoid allocations per iteration.
class TileBinner {
 public:
  // Throws Error{kResourceExhausted} above 2^31 pairs.
  void Bin(const SplatBuffer& splats, int width, int height, ThreadPool& pool, TileLists& lists);

 private:
  struct Span {  // of tiles in a row of tiles
    uint16_t begin = 0;
    uint16_t end = 0;
  };
  struct RowRange {
    uint32_t first_span = 0;  // in the owning thread's spans
    uint16_t first_row = 0;
    uint16_t rows = 0;
    uint16_t owner = 0;  // the thread
  };
  struct Footprint {  // inputs of FillLists for a Gaussian, in depth order
    const Span* spans = nullptr;
    uint32_t gaussian = 0;
    uint32_t first_pair = 0;
    uint16_t first_row = 0;
    uint16_t rows = 0;
  };
  struct Piece {  // visible Gaussians of a thread
    size_t first = 0, count = 0;
    uint32_t low = std::numeric_limits<uint32_t>::max(), high = 0;
  };
  void FindSpans(const SplatBuffer& splats,
                 int width,
                 int64_t begin,
                 int64_t end,
                 int thread,
                 TileLists& lists);
  void ListVisible(const SplatBuffer& splats, ThreadPool& pool);
  void SortByDepth(ThreadPool& pool);
  void FillLists(ThreadPool& pool, TileLists& lists);

  std::vector<std::vector<Span>> spans_;  // per thread
  std::vector<RowRange> rows_;            // per Gaussian
  std::vector<Piece> pieces_;             // per thread
  uint32_t low_key_ = 0, high_key_ = 0;
  std::vector<uint64_t> order_, order_scratch_;  // visible Gaussians: depth key << 32 | index
  std::vector<Footprint> footprints_;
  std::vector<uint32_t> chunk_counts_;  // [thread][tile], or [thread][digit]
};

}  // namespace color3d
