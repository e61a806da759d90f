// About the solutions of one grid for pins that change a little from call to call, as while
// somebody paints. A coarser grid gives a beginning; where pins were only added, of the change
// since the call before. A few iterations on the grid itself follow.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/parallel.h"
#include "core/grid/grid_solver.h"

namespace color3d {

// Not thread-safe.
class QuickGrid {
 public:
  // The coarser grid is half as large `halvings` times, 1..3. The pool must outlive this.
  QuickGrid(GridSystem edges, int halvings, ThreadPool& pool, const CancellationToken& cancel);

  // As GridHierarchy::Solve, but only near the solution, and dependent on the calls before.
  GridSolution Solve(std::vector<uint8_t> pinned,
                     const GridPlane* data,
                     const std::vector<float>& target,
                     const CancellationToken& cancel);
  int64_t bytes() const;

 private:
  // The values of the pins and the data on the coarser grid, solved there, at the fine size.
  std::vector<float> Beginning(const std::vector<uint8_t>& pinned,
                               const GridPlane* data,
                               const std::vector<float>& target,
                               const CancellationToken& cancel);
  bool KeepsPinsOf(const std::vector<uint8_t>& pinned) const;
  std::vector<float> Enlarged(const std::vector<float>& coarse);

  const int factor_;  // px of the grid for one of the coarser one
  ThreadPool& pool_;
  GridHierarchy fine_, coarse_;
  std::vector<uint8_t> pinned_before_;
  std::vector<float> solved_before_;
};

}  // namespace color3d
