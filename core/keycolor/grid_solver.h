// Sparse symmetric positive definite systems on the pixels of a picture: a weighted graph Laplacian
// over the 8-neighbourhood plus a diagonal. Conjugate gradients, preconditioned by one multigrid
// W-cycle, so that the number of iterations hardly grows with the picture. float64, pure.
#pragma once

#include <functional>
#include <vector>

#include "core/base/cancellation.h"

namespace color3d {

// Minimises sum_edges w_ij (u_i - u_j)^2 + sum_i data_i (u_i - target_i)^2 for two targets at once
// (a and b). Arrays have width * height entries, row by row. All weights >= 0, at least one data
// weight > 0, and every pixel connected to one: then the system is positive definite.
struct GridSystem {
  int width = 0;
  int height = 0;
  std::vector<double> right;       // weight of the edge to (x+1, y); 0 in the last column
  std::vector<double> down;        // to (x, y+1)
  std::vector<double> down_right;  // to (x+1, y+1)
  std::vector<double> down_left;   // to (x-1, y+1)
  std::vector<double> data;

  GridSystem() = default;
  GridSystem(int width_px, int height_px);
};

struct GridSolution {
  std::vector<double> u;  // interleaved: u[2 * i] and u[2 * i + 1] belong to pixel i
  int iterations = 0;
  double relative_residual = 0.0;  // |b - A u| / |b|, the larger of the two
  bool converged = false;
};

// `target` is interleaved like u. Stops when the residual, in the 2-norm and in the preconditioned
// norm (about the energy norm of the error), has fallen to `tolerance`; `report` is called after
// every iteration with the relative residual.
GridSolution SolveGridSystem(const GridSystem& system,
                             const std::vector<double>& target,
                             double tolerance,
                             int max_iterations,
                             const std::function<void(int, double)>& report,
                             const CancellationToken& cancel);

}  // namespace color3d
