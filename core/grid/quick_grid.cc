#include "core/grid/quick_grid.h"

#include <algorithm>
#include <utility>

#include "core/grid/halved_grid.h"

namespace color3d {
namespace {

constexpr GridSolveOptions kCoarse{1e-2, 30};
constexpr double kEnough = 1e-3;  // relative residual
// The error of a beginning without a call before is that of all pins.
constexpr int kIterations = 2, kFirstIterations = 3;

GridSystem HalvedGrid(const GridSystem& grid, int times) {
  GridSystem half = HalvedGrid(grid);
  return times > 1 ? HalvedGrid(half, times - 1) : half;
}

}  // namespace

QuickGrid::QuickGrid(GridSystem edges,
                     int halvings,
                     ThreadPool& pool,
                     const CancellationToken& cancel)
    : factor_(1 << halvings),
      pool_(pool),
      fine_(edges, pool, cancel),
      coarse_(HalvedGrid(edges, halvings), pool, cancel) {}

bool QuickGrid::KeepsPinsOf(const std::vector<uint8_t>& pinned) const {
  if (solved_before_.empty()) return false;
  bool keeps = true;
  for (size_t i = 0; i < pinned.size(); ++i) keeps &= pinned_before_[i] <= pinned[i];
  return keeps;
}

std::vector<float> QuickGrid::Beginning(const std::vector<uint8_t>& pinned,
                                        const GridPlane* data,
                                        const std::vector<float>& target,
                                        const CancellationToken& cancel) {
  const int width = coarse_.width(), height = coarse_.height();
  const size_t n = pinned.size(), cells = static_cast<size_t>(width) * height;
  const bool is_change = data == nullptr && KeepsPinsOf(pinned);
  std::vector<uint8_t> cell_pinned(cells, 0);
  std::vector<float> cell_target(2 * cells, 0.0f), count(cells, 0.0f);
  GridPlane cell_data;
  if (data != nullptr) cell_data = GridPlane(width, height);
  for (int y = 0; y < fine_.height(); ++y) {
    const size_t row = static_cast<size_t>(y) * fine_.width();
    const size_t cell_row = static_cast<size_t>(y / factor_) * width;
    for (int x = 0; x < fine_.width(); ++x) {
      const size_t i = row + x, cell = cell_row + x / factor_;
      if (data != nullptr)
        cell_data[static_cast<int64_t>(cell)] += (*data)[static_cast<int64_t>(i)];
      if (!pinned[i]) continue;
      cell_pinned[cell] = 1;
      count[cell] += 1.0f;
      for (size_t c = 0; c < 2; ++c) {
        const float before = is_change ? solved_before_[i + c * n] : 0.0f;
        cell_target[cell + c * cells] += target[i + c * n] - before;
      }
    }
  }
  for (size_t i = 0; i < cells; ++i) {
    if (!cell_pinned[i]) continue;
    cell_target[i] /= count[i];
    cell_target[i + cells] /= count[i];
  }
  std::vector<float> begin = Enlarged(coarse_
                                          .Solve(
                                              std::move(cell_pinned),
                                              data != nullptr ? &cell_data : nullptr,
                                              cell_target,
                                              kCoarse,
                                              [](int, double) {},
                                              cancel)
                                          .u);
  if (is_change) {
    for (size_t i = 0; i < begin.size(); ++i) begin[i] += solved_before_[i];
  }
  return begin;
}

// Bilinear between the middles of the cells.
std::vector<float> QuickGrid::Enlarged(const std::vector<float>& coarse) {
  const int w = fine_.width(), h = fine_.height(), cw = coarse_.width(), ch = coarse_.height();
  std::vector<float> fine(2 * static_cast<size_t>(w) * h);
  struct Place {
    int first, second;
    float share;  // of the second
  };
  const auto place = [&](int at, int count) {
    const float middle =
        std::clamp((static_cast<float>(at) + 0.5f) / static_cast<float>(factor_) - 0.5f,
                   0.0f,
                   static_cast<float>(count - 1));
    const int first = static_cast<int>(middle);
    return Place{first, std::min(first + 1, count - 1), middle - static_cast<float>(first)};
  };
  std::vector<Place> columns(w);
  for (int x = 0; x < w; ++x) columns[x] = place(x, cw);
  pool_.ForRanges(2 * static_cast<int64_t>(h), [&](int64_t begin, int64_t end, int) {
    std::vector<float> row(cw);
    for (int64_t k = begin; k < end; ++k) {
      const Place at = place(static_cast<int>(k % h), ch);
      const float* plane = coarse.data() + (k / h) * static_cast<int64_t>(cw) * ch;
      const float* above = plane + static_cast<int64_t>(at.first) * cw;
      const float* below = plane + static_cast<int64_t>(at.second) * cw;
      for (int x = 0; x < cw; ++x) row[x] = above[x] + at.share * (below[x] - above[x]);
      float* out = fine.data() + k * w;
      for (int x = 0; x < w; ++x) {
        const Place& p = columns[x];
        out[x] = row[p.first] + p.share * (row[p.second] - row[p.first]);
      }
    }
  });
  return fine;
}

GridSolution QuickGrid::Solve(std::vector<uint8_t> pinned,
                              const GridPlane* data,
                              const std::vector<float>& target,
                              const CancellationToken& cancel) {
  const bool is_first = data == nullptr && !KeepsPinsOf(pinned);
  const std::vector<float> start = Beginning(pinned, data, target, cancel);
  if (data == nullptr) pinned_before_ = pinned;
  GridSolution solved = fine_.Solve(
      std::move(pinned),
      data,
      target,
      {kEnough, is_first ? kFirstIterations : kIterations, &start},
      [](int, double) {},
      cancel);
  if (data == nullptr) solved_before_ = solved.u;
  return solved;
}

int64_t QuickGrid::bytes() const {
  const int64_t pixels = static_cast<int64_t>(fine_.width()) * fine_.height();
  return fine_.bytes() + coarse_.bytes() + pixels * static_cast<int64_t>(2 * sizeof(float) + 1);
}

}  // namespace color3d
