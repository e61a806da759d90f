#include "core/grid/grid_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "core/grid/aggregate_cycle.h"
#include "core/grid/grid_kernels.h"

namespace color3d {
namespace {

// A restart that leaves more than this of the residual has met float32's resolution of u.
constexpr double kMaxResidualShare = 0.7;

// sqrt(now / start) of the worse component; a component that starts at zero is solved.
double RelativeNorm(const GridPair& now, const GridPair& start) {
  double worst = 0.0;
  for (int c = 0; c < 2; ++c) {
    if (start[c] > 0.0) worst = std::max(worst, std::sqrt(std::max(now[c], 0.0) / start[c]));
  }
  return worst;
}

double Quotient(double numerator, double denominator) {
  return denominator > 0.0 ? numerator / denominator : 0.0;
}

GridVector MakeVector(const GridSystem& s) {
  return {GridPlane(s.width, s.height), GridPlane(s.width, s.height)};
}

// What a solution needs besides the clusters. May be used again for a grid of the same size: new
// memory of this size takes about as long as an iteration.
struct SolverWork {
  GridSystem system;
  GridPlane scale;
  GridVector b, u, r, z, p, ap, t;
};

class Solver {
 public:
  Solver(GridSystem&& system,
         const std::vector<float>& target,
         ThreadPool& pool,
         const CancellationToken& cancel)
      : own_work_(std::make_unique<SolverWork>()),
        work_(*own_work_),
        target_(target),
        pool_(pool),
        cancel_(cancel) {
    work_.system = std::move(system);
    SetRightSide();
    ComputeScale();
    own_clusters_ = ClusterGrid(system_, pool_);
    cancel_.ThrowIfCancelled();
    own_cycle_ = std::make_unique<AggregateCycle>(
        CoarsenGrid(system_, own_clusters_, pool_), pool_, cancel_);
    clusters_ = &own_clusters_;
    cycle_ = own_cycle_.get();
    MakeVectors();
  }
  // The system is that of `work`; with clusters and a cycle of the same edges without pins and
  // data.
  Solver(SolverWork& work,
         const std::vector<float>& target,
         const Clusters& clusters,
         AggregateCycle& cycle,
         ThreadPool& pool,
         const CancellationToken& cancel)
      : work_(work),
        target_(target),
        pool_(pool),
        cancel_(cancel),
        clusters_(&clusters),
        cycle_(&cycle) {
    SetRightSide();
    ComputeScale();
    cycle_->SetData(DataOfClusters());
    MakeVectors();
  }

  GridSolution Run(const GridSolveOptions& options,
                   const std::function<void(int, double)>& report) {
    if (options.start != nullptr) BeginWith(*options.start);
    const GridPair b_norm = Dot(b_, b_);
    GridSolution solution;
    solution.converged = RelativeNorm(b_norm, b_norm) == 0.0;
    double before = std::numeric_limits<double>::infinity();
    // The recursion's residual drifts from the true one in float32, so it is computed afresh, and
    // the recursion restarted, until it agrees or meets float32's resolution of u.
    while (!solution.converged) {
      ForChunks([&](int64_t begin, int64_t end, int64_t) {
        GridResidual(system_, u_, b_, begin, end, r_);
      });
      solution.relative_residual = RelativeNorm(Dot(r_, r_), b_norm);
      solution.converged = solution.relative_residual <= options.tolerance;
      const bool stuck = solution.relative_residual > kMaxResidualShare * before;
      if (stuck || solution.iterations >= options.max_iterations) break;
      before = solution.relative_residual;
      if (!solution.converged) Iterate(options, b_norm, report, solution);
    }
    Finish(solution);
    return solution;
  }

 private:
  // The margins of vectors that were used before are zero still.
  void MakeVectors() {
    for (auto* vector : {&r_, &z_, &ap_, &t_}) {
      if (vector->a.empty()) *vector = MakeVector(system_);
    }
    for (auto* vector : {&u_, &p_}) {
      if (vector->a.empty()) {
        *vector = MakeVector(system_);
      } else {
        pool_.ForEach(2, [&](int64_t c, int) { (c == 0 ? vector->a : vector->b).Fill(0.0f); });
      }
    }
  }

  // Clusters still have the edges to pinned pixels. Holding these at 0 there as well takes more
  // iterations (measured).
  std::vector<float> DataOfClusters() const {
    std::vector<float> data(clusters_->count, 0.0f);
    const int64_t n = system_.PixelCount();
    pool_.ForEach(static_cast<int64_t>(clusters_->first.size()) - 1, [&](int64_t range, int) {
      const int64_t begin = range * clusters_->range_nodes;
      for (int64_t i = begin; i < std::min(n, begin + clusters_->range_nodes); ++i) {
        data[clusters_->of_node[i]] += system_.data[i];
      }
    });
    return data;
  }

  template <typename Body>
  void ForChunks(Body&& body) {
    const int64_t pixels = system_.PixelCount();
    pool_.ForEach((pixels + kGridChunk - 1) / kGridChunk, [&](int64_t k, int) {
      body(k * kGridChunk, std::min(pixels, (k + 1) * kGridChunk), k);
    });
  }
  // Sum over the chunks in their order, independent of the threads.
  template <typename Body>
  GridPair SumChunks(Body&& body) {
    std::vector<GridPair> parts((system_.PixelCount() + kGridChunk - 1) / kGridChunk);
    ForChunks([&](int64_t begin, int64_t end, int64_t k) { parts[k] = body(begin, end); });
    GridPair total{};
    for (const GridPair& part : parts) {
      for (int c = 0; c < 2; ++c) total[c] += part[c];
    }
    return total;
  }
  GridPair Dot(const GridVector& x, const GridVector& y) {
    return SumChunks([&](int64_t begin, int64_t end) { return GridDot(x, y, begin, end); });
  }

  // b, and pinned pixels moved to it: they leave the system.
  void SetRightSide() {
    const int64_t n = system_.PixelCount(), w = system_.width;
    if (b_.a.empty()) b_ = MakeVector(system_);
    ForChunks([&](int64_t begin, int64_t end, int64_t) {
      for (int64_t i = begin; i < end; ++i) {
        b_.a[i] = system_.data[i] > 0.0f ? system_.data[i] * target_[i] : 0.0f;
        b_.b[i] = system_.data[i] > 0.0f ? system_.data[i] * target_[i + n] : 0.0f;
      }
    });
    if (system_.pinned.empty()) return;
    const std::vector<uint8_t>& pinned = system_.pinned;
    const auto cut = [&](GridPlane& weights, int64_t offset) {
      for (int64_t i = 0; i + offset < n; ++i) {  // edges beyond the last pixel are 0
        if ((pinned[i] | pinned[i + offset]) == 0 || weights[i] == 0.0f) continue;
        const int64_t j = i + offset;
        if (!pinned[j]) MoveToRightSide(weights[i], i, j);
        if (!pinned[i]) MoveToRightSide(weights[i], j, i);
        weights[i] = 0.0f;
      }
    };
    cut(system_.right, 1);
    cut(system_.down, w);
    cut(system_.down_right, w + 1);
    cut(system_.down_left, w - 1);
    for (int64_t i = 0; i < n; ++i) {
      if (pinned[i]) system_.data[i] = b_.a[i] = b_.b[i] = 0.0f;
    }
  }

  void MoveToRightSide(float weight, int64_t pinned, int64_t other) {
    system_.data[other] += weight;
    b_.a[other] += weight * target_[pinned];
    b_.b[other] += weight * target_[pinned + system_.PixelCount()];
  }

  void ComputeScale() {
    if (scale_.empty()) scale_ = GridPlane(system_.width, system_.height);
    const GridSystem& s = system_;
    const int64_t w = s.width;
    ForChunks([&](int64_t begin, int64_t end, int64_t) {
      for (int64_t i = begin; i < end; ++i) {
        const float edges = s.right[i] + s.right[i - 1] + s.down[i] + s.down[i - w] +
                            s.down_right[i] + s.down_right[i - w - 1] + s.down_left[i] +
                            s.down_left[i - w + 1];
        scale_[i] = JacobiScale(edges, s.data[i]);
      }
    });
  }

  // z = M r: one step of Jacobi, the cycle on the aggregates, one step of Jacobi.
  void Precondition() {
    ForChunks([&](int64_t begin, int64_t end, int64_t) { GridScale(scale_, r_, begin, end, z_); });
    ForChunks([&](int64_t begin, int64_t end, int64_t) {
      GridResidual(system_, z_, r_, begin, end, t_);
    });
    std::vector<float>& f = cycle_->right_side();
    const int64_t n = system_.PixelCount();
    pool_.ForEach(static_cast<int64_t>(clusters_->first.size()) - 1, [&](int64_t range, int) {
      std::fill(f.begin() + 2 * clusters_->first[range],
                f.begin() + 2 * clusters_->first[range + 1],
                0.0f);
      const int64_t begin = range * clusters_->range_nodes;
      for (int64_t i = begin; i < std::min(n, begin + clusters_->range_nodes); ++i) {
        const int64_t c = clusters_->of_node[i];
        f[2 * c] += t_.a[i];
        f[2 * c + 1] += t_.b[i];
      }
    });
    cycle_->Run();
    const std::vector<float>& correction = cycle_->answer();
    ForChunks([&](int64_t begin, int64_t end, int64_t) {
      for (int64_t i = begin; i < end; ++i) {
        const int64_t c = clusters_->of_node[i];
        z_.a[i] += correction[2 * c];
        z_.b[i] += correction[2 * c + 1];
      }
    });
    ForChunks([&](int64_t begin, int64_t end, int64_t) {
      GridJacobi(system_, scale_, z_, r_, begin, end, t_);
    });
    std::swap(z_, t_);
  }

  // Flexible conjugate gradients, starting from the residual r_, until the recursion converges. The
  // preconditioner is not linear, hence beta by Polak-Ribiere: (r' - r) . z' = -alpha A p . z'.
  void Iterate(const GridSolveOptions& options,
               const GridPair& b_norm,
               const std::function<void(int, double)>& report,
               GridSolution& solution) {
    Precondition();
    ForChunks([&](int64_t begin, int64_t end, int64_t) {
      GridCombine({0.0, 0.0}, p_, {1.0, 1.0}, z_, begin, end);
    });
    GridPair rz = Dot(r_, z_);
    if (solution.iterations == 0) rz_start_ = rz;
    while (solution.iterations < options.max_iterations) {
      cancel_.ThrowIfCancelled();
      const GridPair p_ap = SumChunks(
          [&](int64_t begin, int64_t end) { return GridApply(system_, p_, begin, end, ap_); });
      const GridPair alpha{Quotient(rz[0], p_ap[0]), Quotient(rz[1], p_ap[1])};
      const GridPair rr = SumChunks([&](int64_t begin, int64_t end) {
        GridCombine({1.0, 1.0}, u_, alpha, p_, begin, end);
        GridCombine({1.0, 1.0}, r_, {-alpha[0], -alpha[1]}, ap_, begin, end);
        return GridDot(r_, r_, begin, end);
      });
      ++solution.iterations;
      const double residual = RelativeNorm(rr, b_norm);
      report(solution.iterations, residual);
      Precondition();
      const GridPair z_ap = Dot(z_, ap_);
      const GridPair beta{Quotient(-alpha[0] * z_ap[0], rz[0]),
                          Quotient(-alpha[1] * z_ap[1], rz[1])};
      rz = Dot(r_, z_);
      ForChunks([&](int64_t begin, int64_t end, int64_t) {
        GridCombine(beta, p_, {1.0, 1.0}, z_, begin, end);
      });
      if (residual > options.tolerance) continue;
      if (options.start != nullptr || RelativeNorm(rz, rz_start_) <= options.tolerance) return;
    }
  }

  void BeginWith(const std::vector<float>& start) {
    const int64_t n = system_.PixelCount();
    ForChunks([&](int64_t begin, int64_t end, int64_t) {
      for (int64_t i = begin; i < end; ++i) {
        const bool pinned = !system_.pinned.empty() && system_.pinned[i];
        u_.a[i] = pinned ? 0.0f : start[i];
        u_.b[i] = pinned ? 0.0f : start[i + n];
      }
    });
  }

  void Finish(GridSolution& solution) {
    const int64_t n = system_.PixelCount();
    solution.u.resize(2 * n);
    ForChunks([&](int64_t begin, int64_t end, int64_t) {
      for (int64_t i = begin; i < end; ++i) {
        const bool pinned = !system_.pinned.empty() && system_.pinned[i];
        solution.u[i] = pinned ? target_[i] : u_.a[i];
        solution.u[i + n] = pinned ? target_[i + n] : u_.b[i];
      }
    });
  }

  std::unique_ptr<SolverWork> own_work_;
  SolverWork& work_;
  GridSystem& system_ = work_.system;
  const std::vector<float>& target_;
  ThreadPool& pool_;
  const CancellationToken& cancel_;
  GridPlane& scale_ = work_.scale;
  Clusters own_clusters_;
  std::unique_ptr<AggregateCycle> own_cycle_;
  const Clusters* clusters_;
  AggregateCycle* cycle_;
  GridVector &b_ = work_.b, &u_ = work_.u, &r_ = work_.r, &z_ = work_.z, &p_ = work_.p,
             &ap_ = work_.ap, &t_ = work_.t;
  GridPair rz_start_{};
};

}  // namespace

struct GridHierarchy::Parts {
  GridSystem edges;
  ThreadPool& pool;
  Clusters clusters;
  std::unique_ptr<AggregateCycle> cycle;
  SolverWork work;
};

GridHierarchy::GridHierarchy(GridSystem edges, ThreadPool& pool, const CancellationToken& cancel)
    : parts_(new Parts{std::move(edges), pool, {}, nullptr, {}}) {
  Parts& p = *parts_;
  p.edges.data.Fill(0.0f);
  p.edges.pinned.clear();
  p.clusters = ClusterGrid(p.edges, pool);
  p.cycle = std::make_unique<AggregateCycle>(CoarsenGrid(p.edges, p.clusters, pool), pool, cancel);
}

GridHierarchy::~GridHierarchy() = default;

GridSolution GridHierarchy::Solve(std::vector<uint8_t> pinned,
                                  const GridPlane* data,
                                  const std::vector<float>& target,
                                  const GridSolveOptions& options,
                                  const std::function<void(int, double)>& report,
                                  const CancellationToken& cancel) {
  cancel.ThrowIfCancelled();
  const GridSystem& edges = parts_->edges;
  GridSystem& system = parts_->work.system;
  system.width = edges.width;
  system.height = edges.height;
  system.pinned = std::move(pinned);
  const std::pair<GridPlane*, const GridPlane*> copies[] = {
      {&system.right, &edges.right},
      {&system.down, &edges.down},
      {&system.down_right, &edges.down_right},
      {&system.down_left, &edges.down_left},
      {&system.data, data != nullptr ? data : &edges.data}};
  parts_->pool.ForEach(5, [&](int64_t k, int) { *copies[k].first = *copies[k].second; });
  return Solver(parts_->work, target, parts_->clusters, *parts_->cycle, parts_->pool, cancel)
      .Run(options, report);
}

int GridHierarchy::width() const { return parts_->edges.width; }
int GridHierarchy::height() const { return parts_->edges.height; }

int64_t GridHierarchy::bytes() const {
  // Edges, their copy, clusters and the vectors of a solution.
  constexpr int64_t kPlanes = 5 + 5 + 1 + 1 + 2 * 7;
  return parts_->edges.PixelCount() * (kPlanes * static_cast<int64_t>(sizeof(float)) + 1) +
         parts_->cycle->bytes();
}

GridPlane::GridPlane(int width_px, int height_px)
    : margin_(width_px + 1 + kGridMargin),
      storage_(static_cast<size_t>(width_px) * height_px + 2 * margin_, 0.0f) {}

void GridPlane::Fill(float value) {
  std::fill(storage_.begin() + margin_, storage_.end() - margin_, value);
}

GridSystem::GridSystem(int width_px, int height_px) : width(width_px), height(height_px) {
  for (auto* plane : {&right, &down, &down_right, &down_left, &data}) {
    *plane = GridPlane(width_px, height_px);
  }
}

GridSolution SolveGridSystem(GridSystem&& system,
                             const std::vector<float>& target,
                             const GridSolveOptions& options,
                             ThreadPool& pool,
                             const std::function<void(int, double)>& report,
                             const CancellationToken& cancel) {
  cancel.ThrowIfCancelled();
  return Solver(std::move(system), target, pool, cancel).Run(options, report);
}

}  // namespace color3d
