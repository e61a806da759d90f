#include "core/grid/aggregate_cycle.h"

#include <algorithm>
#include <cstring>
#include <functional>
#include <utility>

namespace color3d {
namespace {

constexpr int64_t kCoarsestNodes = 300;
constexpr int64_t kChunkNodes = 1 << 14;
constexpr double kMinShrink = 1.2;  // levels end when they hardly get smaller
constexpr double kShrinkForTwice = 2.4;
// The largest levels are visited once: twice saves iterations there, but no time (measured).
constexpr size_t kLevelsOnce = 2;
constexpr double kGoodReduction = 0.25;  // of the residual, after which one step is enough

using Pair = std::array<double, 2>;
using Range = std::function<void(int64_t begin, int64_t end, int64_t chunk)>;

void ForChunks(int64_t nodes, ThreadPool& pool, const Range& body) {
  const int64_t chunks = (nodes + kChunkNodes - 1) / kChunkNodes;
  auto run = [&](int64_t k, int) {
    body(k * kChunkNodes, std::min(nodes, (k + 1) * kChunkNodes), k);
  };
  if (chunks == 1) {
    run(0, 0);
  } else {
    pool.ForEach(chunks, run);
  }
}

Pair Dot(const std::vector<float>& x, const std::vector<float>& y, ThreadPool& pool) {
  const auto nodes = static_cast<int64_t>(x.size()) / 2;
  std::vector<Pair> parts((nodes + kChunkNodes - 1) / kChunkNodes);
  ForChunks(nodes, pool, [&](int64_t begin, int64_t end, int64_t chunk) {
    Pair sum{};
    for (int64_t i = begin; i < end; ++i) {
      sum[0] += static_cast<double>(x[2 * i]) * y[2 * i];
      sum[1] += static_cast<double>(x[2 * i + 1]) * y[2 * i + 1];
    }
    parts[chunk] = sum;
  });
  Pair total{};
  for (const Pair& part : parts) {
    for (int c = 0; c < 2; ++c) total[c] += part[c];
  }
  return total;
}

// x = p x + q y.
void Combine(const Pair& p,
             std::vector<float>& x,
             const Pair& q,
             const std::vector<float>& y,
             ThreadPool& pool) {
  const std::array<float, 2> ps{static_cast<float>(p[0]), static_cast<float>(p[1])};
  const std::array<float, 2> qs{static_cast<float>(q[0]), static_cast<float>(q[1])};
  ForChunks(static_cast<int64_t>(x.size()) / 2, pool, [&](int64_t begin, int64_t end, int64_t) {
    for (int64_t i = 2 * begin; i < 2 * end; i += 2) {
      x[i] = ps[0] * x[i] + qs[0] * y[i];
      x[i + 1] = ps[1] * x[i + 1] + qs[1] * y[i + 1];
    }
  });
}

// Both components of a node at once (GCC's and Clang's vector extension).
using Float2 = float __attribute__((vector_size(2 * sizeof(float))));

inline Float2 Load(const float* u, int64_t i) {
  Float2 value;
  std::memcpy(&value, u + 2 * i, sizeof(value));
  return value;
}

inline void Store(Float2 value, float* u, int64_t i) {
  std::memcpy(u + 2 * i, &value, sizeof(value));
}

// A u at one node.
inline Float2 Applied(const AggregateGraph& g, const float* u, int64_t i) {
  const Float2 own = Load(u, i);
  Float2 sum = g.data[i] * own;
  for (int64_t k = g.row_begin[i]; k < g.row_begin[i + 1]; ++k) {
    sum += g.weight[k] * (own - Load(u, g.neighbor[k]));
  }
  return sum;
}

void Apply(const AggregateGraph& g,
           const std::vector<float>& u,
           std::vector<float>& out,
           ThreadPool& pool) {
  ForChunks(g.NodeCount(), pool, [&](int64_t begin, int64_t end, int64_t) {
    for (int64_t i = begin; i < end; ++i) {
      Store(Applied(g, u.data(), i), out.data(), i);
    }
  });
}

double Quotient(double numerator, double denominator) {
  return denominator > 0.0 ? numerator / denominator : 0.0;
}

}  // namespace

float JacobiScale(float edge_sum, float data) {
  const float diagonal = edge_sum + data;
  if (!(diagonal > 0.0f)) return 0.0f;
  return (edge_sum > 0.0f ? kJacobiDamping : 1.0f) / diagonal;
}

AggregateCycle::AggregateCycle(AggregateGraph finest,
                               ThreadPool& pool,
                               const CancellationToken& cancel)
    : pool_(pool) {
  AggregateGraph graph = std::move(finest);
  while (true) {
    cancel.ThrowIfCancelled();
    Level& level = levels_.emplace_back();
    level.graph = std::move(graph);
    const AggregateGraph& g = level.graph;
    const int64_t nodes = g.NodeCount();
    for (auto* vector : {&level.u, &level.f, &level.r, &level.k, &level.ak}) {
      vector->assign(2 * nodes, 0.0f);
    }
    level.edge_sum.resize(nodes);
    level.scale.resize(nodes);
    for (int64_t i = 0; i < nodes; ++i) {
      float sum = 0.0f;
      for (int64_t k = g.row_begin[i]; k < g.row_begin[i + 1]; ++k) sum += g.weight[k];
      level.edge_sum[i] = sum;
      level.scale[i] = JacobiScale(sum, g.data[i]);
    }
    if (nodes <= kCoarsestNodes) break;
    Clusters clusters = ClusterGraph(g, pool_);
    if (static_cast<double>(nodes) < kMinShrink * static_cast<double>(clusters.count)) break;
    level.twice =
        levels_.size() > kLevelsOnce &&
        static_cast<double>(nodes) > kShrinkForTwice * static_cast<double>(clusters.count);
    graph = CoarsenGraph(g, clusters, pool_);
    level.clusters = std::move(clusters);
  }
  FactorCoarsest();
}

void AggregateCycle::SetData(std::vector<float> finest) {
  std::vector<float> data = std::move(finest);
  for (Level& level : levels_) {
    level.graph.data = std::move(data);
    const int64_t nodes = level.graph.NodeCount();
    for (int64_t i = 0; i < nodes; ++i) {
      level.scale[i] = JacobiScale(level.edge_sum[i], level.graph.data[i]);
    }
    data.assign(level.clusters.count, 0.0f);
    if (data.empty()) break;
    for (int64_t i = 0; i < nodes; ++i) data[level.clusters.of_node[i]] += level.graph.data[i];
  }
  FactorCoarsest();
}

int64_t AggregateCycle::bytes() const {
  int64_t bytes = 0;
  for (const Level& level : levels_) {
    const AggregateGraph& g = level.graph;
    bytes += g.NodeCount() * static_cast<int64_t>(13 * sizeof(float) + sizeof(int64_t)) +
             static_cast<int64_t>(g.weight.size() * (sizeof(float) + sizeof(int32_t)) +
                                  level.clusters.of_node.size() * sizeof(int32_t));
  }
  return bytes;
}

void AggregateCycle::FactorCoarsest() {
  const AggregateGraph& g = levels_.back().graph;
  const int64_t n = g.NodeCount();
  if (n > kCoarsestNodes) return;  // smoothing must do
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n);
  for (int64_t i = 0; i < n; ++i) {
    a(i, i) += g.data[i];
    for (int64_t k = g.row_begin[i]; k < g.row_begin[i + 1]; ++k) {
      a(i, i) += g.weight[k];
      a(i, g.neighbor[k]) -= g.weight[k];
    }
    // A part of the picture without known pixels: any solution will do.
    a(i, i) = a(i, i) > 0.0 ? a(i, i) * (1.0 + 1e-12) : 1.0;
  }
  coarsest_.compute(a);
}

void AggregateCycle::SolveCoarsest() {
  Level& level = levels_.back();
  const auto n = static_cast<Eigen::Index>(level.graph.NodeCount());
  if (n > kCoarsestNodes) {
    constexpr int kSweeps = 8;
    std::fill(level.u.begin(), level.u.end(), 0.0f);
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      Apply(level.graph, level.u, level.r, pool_);
      for (size_t i = 0; i < level.u.size(); ++i) {
        level.u[i] += level.scale[i / 2] * (level.f[i] - level.r[i]);
      }
    }
    return;
  }
  using Columns = Eigen::Matrix<float, Eigen::Dynamic, 2, Eigen::RowMajor>;
  const Eigen::MatrixXd f = Eigen::Map<const Columns>(level.f.data(), n, 2).cast<double>();
  Eigen::Map<Columns>(level.u.data(), n, 2) = coarsest_.solve(f).cast<float>();
}

void AggregateCycle::Restrict(const Level& fine, Level& coarse) {
  const Clusters& clusters = fine.clusters;
  const auto ranges = static_cast<int64_t>(clusters.first.size()) - 1;
  const int64_t nodes = fine.graph.NodeCount();
  auto run = [&](int64_t range, int) {
    std::fill(coarse.f.begin() + 2 * clusters.first[range],
              coarse.f.begin() + 2 * clusters.first[range + 1],
              0.0f);
    const int64_t begin = range * clusters.range_nodes;
    for (int64_t i = begin; i < std::min(nodes, begin + clusters.range_nodes); ++i) {
      const int64_t c = clusters.of_node[i];
      coarse.f[2 * c] += fine.r[2 * i];
      coarse.f[2 * c + 1] += fine.r[2 * i + 1];
    }
  };
  if (ranges == 1) {
    run(0, 0);
  } else {
    pool_.ForEach(ranges, run);
  }
}

void AggregateCycle::Prolong(const Level& coarse, Level& fine) {
  ForChunks(fine.graph.NodeCount(), pool_, [&](int64_t begin, int64_t end, int64_t) {
    for (int64_t i = begin; i < end; ++i) {
      const int64_t c = fine.clusters.of_node[i];
      fine.u[2 * i] += coarse.u[2 * c];
      fine.u[2 * i + 1] += coarse.u[2 * c + 1];
    }
  });
}

// level.u = about A^-1 level.f.
void AggregateCycle::Cycle(size_t index) {
  if (index + 1 == levels_.size()) return SolveCoarsest();
  Level& level = levels_[index];
  const AggregateGraph& g = level.graph;
  const int64_t nodes = g.NodeCount();
  ForChunks(nodes, pool_, [&](int64_t begin, int64_t end, int64_t) {
    for (int64_t i = begin; i < end; ++i) {
      Store(level.scale[i] * Load(level.f.data(), i), level.u.data(), i);
    }
  });
  ForChunks(nodes, pool_, [&](int64_t begin, int64_t end, int64_t) {
    for (int64_t i = begin; i < end; ++i) {
      Store(Load(level.f.data(), i) - Applied(g, level.u.data(), i), level.r.data(), i);
    }
  });
  Level& coarse = levels_[index + 1];
  Restrict(level, coarse);
  Solve(index + 1);
  Prolong(coarse, level);
  ForChunks(nodes, pool_, [&](int64_t begin, int64_t end, int64_t) {
    for (int64_t i = begin; i < end; ++i) {
      const Float2 residual = Load(level.f.data(), i) - Applied(g, level.u.data(), i);
      Store(Load(level.u.data(), i) + level.scale[i] * residual, level.r.data(), i);
    }
  });
  level.u.swap(level.r);
}

// Up to two steps of conjugate gradients around Cycle; level.f is used up.
void AggregateCycle::Solve(size_t index) {
  Level& level = levels_[index];
  Cycle(index);
  if (!level.twice) return;
  level.k.swap(level.u);
  Apply(level.graph, level.k, level.ak, pool_);
  const Pair kak = Dot(level.k, level.ak, pool_), kf = Dot(level.k, level.f, pool_);
  const Pair before = Dot(level.f, level.f, pool_);
  const Pair t{Quotient(kf[0], kak[0]), Quotient(kf[1], kak[1])};
  Combine({1.0, 1.0}, level.f, {-t[0], -t[1]}, level.ak, pool_);
  const Pair after = Dot(level.f, level.f, pool_);
  constexpr double kEnough = kGoodReduction * kGoodReduction;
  if (after[0] <= kEnough * before[0] && after[1] <= kEnough * before[1]) {
    level.u.swap(level.k);
    return Combine(t, level.u, {0.0, 0.0}, level.u, pool_);
  }
  Cycle(index);
  const Pair gamma = Dot(level.u, level.ak, pool_), uf = Dot(level.u, level.f, pool_);
  Apply(level.graph, level.u, level.r, pool_);
  const Pair uau = Dot(level.u, level.r, pool_);
  Pair of_k{}, of_u{};
  for (int c = 0; c < 2; ++c) {
    const double rho = uau[c] - Quotient(gamma[c] * gamma[c], kak[c]);
    // Below rounding the second direction adds no information.
    of_u[c] = rho > 1e-7 * uau[c] ? uf[c] / rho : 0.0;
    of_k[c] = t[c] - Quotient(gamma[c] * of_u[c], kak[c]);
  }
  Combine(of_u, level.u, of_k, level.k, pool_);
}

}  // namespace color3d
