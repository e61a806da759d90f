#include "core/keycolor/grid_solver.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

namespace color3d {
namespace {

constexpr int kCoarsestPixels = 100;
// Piecewise constant interpolation makes the coarse operator too stiff (by up to 2 in 2-D); the
// coarse edges are weakened instead of over-correcting (Braess 1995).
constexpr double kCoarseEdgeScale = 1.0 / 1.7;

using Vector = std::vector<double>;  // interleaved pairs
using Pair = std::array<double, 2>;

struct Level {
  GridSystem system;
  Vector diagonal;  // sum of the edges plus data
  Vector u, f, r;   // work space of the cycle
};

// The neighbours of pixel i with their weights, in a fixed order; `visit(j, w)`.
template <typename Visit>
inline void ForNeighbours(const GridSystem& s, int x, int y, int64_t i, Visit&& visit) {
  const int64_t w = s.width;
  if (y > 0) {
    if (x > 0) visit(i - w - 1, s.down_right[i - w - 1]);
    visit(i - w, s.down[i - w]);
    if (x + 1 < w) visit(i - w + 1, s.down_left[i - w + 1]);
  }
  if (x > 0) visit(i - 1, s.right[i - 1]);
  if (x + 1 < w) visit(i + 1, s.right[i]);
  if (y + 1 < s.height) {
    if (x > 0) visit(i + w - 1, s.down_left[i]);
    visit(i + w, s.down[i]);
    if (x + 1 < w) visit(i + w + 1, s.down_right[i]);
  }
}

Vector Diagonal(const GridSystem& s) {
  Vector diagonal(s.data);
  for (int y = 0; y < s.height; ++y) {
    for (int x = 0; x < s.width; ++x) {
      const int64_t i = static_cast<int64_t>(y) * s.width + x;
      ForNeighbours(s, x, y, i, [&](int64_t, double weight) { diagonal[i] += weight; });
    }
  }
  return diagonal;
}

Pair NeighbourSum(const GridSystem& s, const Vector& u, int x, int y, int64_t i) {
  Pair sum{};
  ForNeighbours(s, x, y, i, [&](int64_t j, double weight) {
    sum[0] += weight * u[2 * j];
    sum[1] += weight * u[2 * j + 1];
  });
  return sum;
}

// out = A u.
void Apply(const Level& level, const Vector& u, Vector& out) {
  const GridSystem& s = level.system;
  for (int y = 0; y < s.height; ++y) {
    for (int x = 0; x < s.width; ++x) {
      const int64_t i = static_cast<int64_t>(y) * s.width + x;
      const Pair sum = NeighbourSum(s, u, x, y, i);
      out[2 * i] = level.diagonal[i] * u[2 * i] - sum[0];
      out[2 * i + 1] = level.diagonal[i] * u[2 * i + 1] - sum[1];
    }
  }
}

// One Gauss-Seidel sweep on A u = f, forwards or backwards: the two are each other's adjoint, which
// keeps the cycle symmetric.
void Smooth(const Level& level, const Vector& f, Vector& u, bool forwards) {
  const GridSystem& s = level.system;
  for (int row = 0; row < s.height; ++row) {
    const int y = forwards ? row : s.height - 1 - row;
    for (int column = 0; column < s.width; ++column) {
      const int x = forwards ? column : s.width - 1 - column;
      const int64_t i = static_cast<int64_t>(y) * s.width + x;
      const Pair sum = NeighbourSum(s, u, x, y, i);
      const double inverse = 1.0 / level.diagonal[i];
      u[2 * i] = (f[2 * i] + sum[0]) * inverse;
      u[2 * i + 1] = (f[2 * i + 1] + sum[1]) * inverse;
    }
  }
}

// Galerkin coarsening with 2x2 blocks.
GridSystem Coarsen(const GridSystem& fine) {
  GridSystem coarse((fine.width + 1) / 2, (fine.height + 1) / 2);
  const int64_t w = coarse.width;
  auto add_edge = [&](int x0, int y0, int x1, int y1, double weight) {
    int ax = x0 / 2, ay = y0 / 2, bx = x1 / 2, by = y1 / 2;
    if (ax == bx && ay == by) return;
    if (by < ay || (by == ay && bx < ax)) {
      std::swap(ax, bx);
      std::swap(ay, by);
    }
    const int64_t i = ay * w + ax;
    weight *= kCoarseEdgeScale;
    if (ay == by) {
      coarse.right[i] += weight;
    } else if (ax == bx) {
      coarse.down[i] += weight;
    } else if (bx > ax) {
      coarse.down_right[i] += weight;
    } else {
      coarse.down_left[i] += weight;
    }
  };
  for (int y = 0; y < fine.height; ++y) {
    for (int x = 0; x < fine.width; ++x) {
      const int64_t i = static_cast<int64_t>(y) * fine.width + x;
      coarse.data[(y / 2) * w + x / 2] += fine.data[i];
      if (x + 1 < fine.width) add_edge(x, y, x + 1, y, fine.right[i]);
      if (y + 1 >= fine.height) continue;
      add_edge(x, y, x, y + 1, fine.down[i]);
      if (x + 1 < fine.width) add_edge(x, y, x + 1, y + 1, fine.down_right[i]);
      if (x > 0) add_edge(x, y, x - 1, y + 1, fine.down_left[i]);
    }
  }
  return coarse;
}

class Multigrid {
 public:
  explicit Multigrid(const GridSystem& system) {
    GridSystem current = system;
    while (true) {
      Level level;
      const size_t pixels = current.data.size();
      level.diagonal = Diagonal(current);
      level.u.resize(2 * pixels);
      level.f.resize(2 * pixels);
      level.r.resize(2 * pixels);
      level.system = std::move(current);
      levels_.push_back(std::move(level));
      if (pixels <= kCoarsestPixels) break;
      current = Coarsen(levels_.back().system);
    }
    FactorCoarsest();
  }

  const Level& finest() const { return levels_[0]; }

  // z = M r, with M symmetric positive definite and close to the inverse of A.
  void Precondition(const Vector& r, Vector& z) {
    levels_[0].f = r;
    std::fill(levels_[0].u.begin(), levels_[0].u.end(), 0.0);
    Cycle(0);
    z = levels_[0].u;
  }

 private:
  void FactorCoarsest() {
    const Level& level = levels_.back();
    const GridSystem& s = level.system;
    const auto n = static_cast<Eigen::Index>(s.data.size());
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n);
    for (int y = 0; y < s.height; ++y) {
      for (int x = 0; x < s.width; ++x) {
        const int64_t i = static_cast<int64_t>(y) * s.width + x;
        a(i, i) = level.diagonal[i];
        ForNeighbours(s, x, y, i, [&](int64_t j, double weight) { a(i, j) -= weight; });
      }
    }
    coarsest_.compute(a);
  }

  // Improves level.u on A u = level.f; a W-cycle, started from the u that is there.
  void Cycle(size_t index) {
    Level& level = levels_[index];
    if (index + 1 == levels_.size()) {
      const auto n = static_cast<Eigen::Index>(level.system.data.size());
      using Columns = Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>;
      const Columns f = Eigen::Map<const Columns>(level.f.data(), n, 2);
      Eigen::Map<Columns>(level.u.data(), n, 2) = coarsest_.solve(f);
      return;
    }
    Smooth(level, level.f, level.u, /*forwards=*/true);
    Apply(level, level.u, level.r);
    for (size_t i = 0; i < level.r.size(); ++i) level.r[i] = level.f[i] - level.r[i];
    Level& coarse = levels_[index + 1];
    std::fill(coarse.u.begin(), coarse.u.end(), 0.0);
    Restrict(level, coarse);
    // Two coarse cycles, the second on the residual of the first (W); exact on the coarsest level.
    Cycle(index + 1);
    if (index + 2 < levels_.size()) Cycle(index + 1);
    Prolong(coarse, level);
    Smooth(level, level.f, level.u, /*forwards=*/false);
  }

  static void Restrict(const Level& fine, Level& coarse) {
    std::fill(coarse.f.begin(), coarse.f.end(), 0.0);
    for (int y = 0; y < fine.system.height; ++y) {
      for (int x = 0; x < fine.system.width; ++x) {
        const int64_t i = static_cast<int64_t>(y) * fine.system.width + x;
        const int64_t j = static_cast<int64_t>(y / 2) * coarse.system.width + x / 2;
        coarse.f[2 * j] += fine.r[2 * i];
        coarse.f[2 * j + 1] += fine.r[2 * i + 1];
      }
    }
  }

  static void Prolong(const Level& coarse, Level& fine) {
    for (int y = 0; y < fine.system.height; ++y) {
      for (int x = 0; x < fine.system.width; ++x) {
        const int64_t i = static_cast<int64_t>(y) * fine.system.width + x;
        const int64_t j = static_cast<int64_t>(y / 2) * coarse.system.width + x / 2;
        fine.u[2 * i] += coarse.u[2 * j];
        fine.u[2 * i + 1] += coarse.u[2 * j + 1];
      }
    }
  }

  std::vector<Level> levels_;
  Eigen::LDLT<Eigen::MatrixXd> coarsest_;
};

Pair Dot(const Vector& x, const Vector& y) {
  Pair sum{};
  for (size_t i = 0; i < x.size(); i += 2) {
    sum[0] += x[i] * y[i];
    sum[1] += x[i + 1] * y[i + 1];
  }
  return sum;
}

// x + factor * y, per component.
void AddScaled(Vector& x, const Pair& factor, const Vector& y) {
  for (size_t i = 0; i < x.size(); i += 2) {
    x[i] += factor[0] * y[i];
    x[i + 1] += factor[1] * y[i + 1];
  }
}

// sqrt(now / start) of the worse component; a component that starts at zero is solved.
double RelativeNorm(const Pair& now, const Pair& start) {
  double worst = 0.0;
  for (int c = 0; c < 2; ++c) {
    if (start[c] > 0.0) worst = std::max(worst, std::sqrt(std::max(now[c], 0.0) / start[c]));
  }
  return worst;
}

double Quotient(double numerator, double denominator) {
  return denominator > 0.0 ? numerator / denominator : 0.0;
}

}  // namespace

GridSystem::GridSystem(int width_px, int height_px) : width(width_px), height(height_px) {
  const size_t pixels = static_cast<size_t>(width_px) * height_px;
  for (auto* array : {&right, &down, &down_right, &down_left, &data}) array->assign(pixels, 0.0);
}

GridSolution SolveGridSystem(const GridSystem& system,
                             const std::vector<double>& target,
                             double tolerance,
                             int max_iterations,
                             const std::function<void(int, double)>& report,
                             const CancellationToken& cancel) {
  Multigrid multigrid(system);
  const size_t n = 2 * system.data.size();
  Vector r(n), z(n), ap(n);
  for (size_t i = 0; i < n; ++i) r[i] = system.data[i / 2] * target[i];  // b, and u = 0
  const Pair b_norm = Dot(r, r);
  GridSolution solution;
  solution.u.assign(n, 0.0);
  multigrid.Precondition(r, z);
  Vector p = z;
  Pair rz = Dot(r, z);
  const Pair rz_start = rz;
  solution.converged = RelativeNorm(b_norm, b_norm) == 0.0;
  while (!solution.converged && solution.iterations < max_iterations) {
    cancel.ThrowIfCancelled();
    Apply(multigrid.finest(), p, ap);
    const Pair p_ap = Dot(p, ap);
    const Pair alpha{Quotient(rz[0], p_ap[0]), Quotient(rz[1], p_ap[1])};
    AddScaled(solution.u, alpha, p);
    AddScaled(r, {-alpha[0], -alpha[1]}, ap);
    multigrid.Precondition(r, z);
    const Pair rz_next = Dot(r, z);
    const Pair beta{Quotient(rz_next[0], rz[0]), Quotient(rz_next[1], rz[1])};
    for (size_t i = 0; i < n; i += 2) {
      p[i] = z[i] + beta[0] * p[i];
      p[i + 1] = z[i + 1] + beta[1] * p[i + 1];
    }
    rz = rz_next;
    ++solution.iterations;
    solution.relative_residual = RelativeNorm(Dot(r, r), b_norm);
    solution.converged =
        solution.relative_residual <= tolerance && RelativeNorm(rz, rz_start) <= tolerance;
    report(solution.iterations, solution.relative_residual);
  }
  return solution;
}

}  // namespace color3d
