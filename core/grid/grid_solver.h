// Sparse symmetric positive definite systems on the pixels of a picture: a weighted graph Laplacian
// over the 8-neighbourhood plus a diagonal. Flexible conjugate gradients, preconditioned by an
// aggregation multigrid whose aggregates follow the strong edges (aggregate_graph.h), so that the
// number of iterations hardly depends on the size of the picture or the contrast of the weights.
// float32 arrays, float64 sums. Pure; the result does not depend on the number of threads.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/parallel.h"

namespace color3d {

// One number per pixel, row by row, with zeros before and after, so that kernels may read (and
// write zeros) beyond both ends: with edge weights of zero at the borders no loop needs a branch.
class GridPlane {
 public:
  GridPlane() = default;
  GridPlane(int width_px, int height_px);
  float& operator[](int64_t i) { return storage_[i + margin_]; }
  float operator[](int64_t i) const { return storage_[i + margin_]; }
  float* data() { return storage_.data() + margin_; }
  const float* data() const { return storage_.data() + margin_; }
  bool empty() const { return storage_.empty(); }
  void Fill(float value);  // the pixels; the margins stay zero

 private:
  int64_t margin_ = 0;
  std::vector<float> storage_;
};

// Minimises sum_edges w_ij (u_i - u_j)^2 + sum_i data_i (u_i - target_i)^2 for two targets at once
// (a and b), under u_i = target_i where pinned. All weights are finite and >= 0, edges that would
// leave the picture 0. A pixel that is connected to nothing known keeps the value 0.
struct GridSystem {
  int width = 0;
  int height = 0;
  GridPlane right;       // weight of the edge to (x+1, y)
  GridPlane down;        // to (x, y+1)
  GridPlane down_right;  // to (x+1, y+1)
  GridPlane down_left;   // to (x-1, y+1)
  GridPlane data;
  std::vector<uint8_t> pinned;  // 1 where u is the target exactly; empty: nowhere

  GridSystem() = default;
  GridSystem(int width_px, int height_px);
  int64_t PixelCount() const { return static_cast<int64_t>(width) * height; }
};

struct GridSolveOptions {
  double tolerance = 1e-4;
  int max_iterations = 200;
  // Values to begin with, laid out as GridSolution::u, e.g. of a solution for about the same
  // targets; null: 0. The iterations then end at the 2-norm of the residual alone.
  const std::vector<float>* start = nullptr;
};

struct GridSolution {
  std::vector<float> u;  // width * height values of a, then of b
  int iterations = 0;
  // |b - A u| / |b| of the system without its pinned pixels, the larger of the two; of the returned
  // u, computed afresh, not the recursion's.
  double relative_residual = 0.0;
  bool converged = false;
};

// `target` is laid out like u; it is read where data > 0 and where pinned. Stops when the residual,
// in the 2-norm and in the preconditioned norm (about the energy norm of the error), has fallen to
// the tolerance, or as low as float32 values of u allow. `report` is called after every iteration
// with the relative residual. The system is used up.
GridSolution SolveGridSystem(GridSystem&& system,
                             const std::vector<float>& target,
                             const GridSolveOptions& options,
                             ThreadPool& pool,
                             const std::function<void(int, double)>& report,
                             const CancellationToken& cancel);

// What the edges alone determine of a solution, for several ones with other pinned pixels, data and
// targets: the preconditioner, more than half of the time of one solution. Not thread-safe.
class GridHierarchy {
 public:
  // The data and pins of `edges` are ignored. The pool must outlive the hierarchy.
  GridHierarchy(GridSystem edges, ThreadPool& pool, const CancellationToken& cancel);
  ~GridHierarchy();

  // As SolveGridSystem for the edges with these pins and data. `data`: of the size of the edges;
  // null: 0. Equal to it within the tolerance, in about as many iterations.
  GridSolution Solve(std::vector<uint8_t> pinned,
                     const GridPlane* data,
                     const std::vector<float>& target,
                     const GridSolveOptions& options,
                     const std::function<void(int, double)>& report,
                     const CancellationToken& cancel);
  int width() const;
  int height() const;
  int64_t bytes() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace color3d
