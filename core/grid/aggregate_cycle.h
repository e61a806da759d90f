// One multigrid cycle on the aggregated graphs (aggregate_graph.h). For this folder only.
#pragma once

#include <Eigen/Cholesky>
#include <array>
#include <cstdint>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/parallel.h"
#include "core/grid/aggregate_graph.h"

namespace color3d {

// Damping of the Jacobi smoother: eigenvalues of D^-1 A reach 2.
inline constexpr float kJacobiDamping = 0.7f;
// Factor on the residual in a Jacobi step. A node without an edge is solved exactly.
float JacobiScale(float edge_sum, float data);

// Approximate inverse of the Laplacian of a graph: damped Jacobi before and after, and on coarser
// levels two steps of conjugate gradients each around the next cycle (K-cycle, Notay & Vassilevski
// 2008). Two right-hand sides at once, interleaved. Not thread-safe.
class AggregateCycle {
 public:
  AggregateCycle(AggregateGraph finest, ThreadPool& pool, const CancellationToken& cancel);

  // Buffers of the right-hand side before Run (overwritten by it) and of the solution after it.
  std::vector<float>& right_side() { return levels_[0].f; }
  const std::vector<float>& answer() const { return levels_[0].u; }
  void Run() { Solve(0); }

  // Replaces the data of the finest graph, and with it that of all levels. The edges and clusters
  // stay.
  void SetData(std::vector<float> finest);
  int64_t bytes() const;

 private:
  struct Level {
    AggregateGraph graph;
    Clusters clusters;  // into the next level; empty on the coarsest
    std::vector<float> edge_sum, scale;
    std::vector<float> u, f, r, k, ak;  // interleaved work vectors
    bool twice = false;                 // K-cycle: it costs too much where levels hardly shrink
  };

  void FactorCoarsest();
  void SolveCoarsest();
  void Solve(size_t index);
  void Cycle(size_t index);
  void Prolong(const Level& coarse, Level& fine);
  void Restrict(const Level& fine, Level& coarse);

  ThreadPool& pool_;
  std::vector<Level> levels_;
  Eigen::LDLT<Eigen::MatrixXd> coarsest_;
};

}  // namespace color3d
