#include "core/splat/chroma/chroma_start.h"

#include <algorithm>
#include <cmath>

#include "core/splat/model/neighbors.h"
#include "core/splat/model/spherical_harmonics.h"

namespace color3d {
namespace {

// Blending weight, summed over all training pixels, below which a Gaussian counts as unseen.
constexpr double kMinSeenWeight = 0.05;
constexpr int kFillNeighbors = 4;

NeighborTree::Point PositionOf(const ParameterBlock& p, int64_t i) {
  return {p.Row(kPositionRow)[i], p.Row(kPositionRow + 1)[i], p.Row(kPositionRow + 2)[i]};
}

}  // namespace

std::vector<char> SetClosedForm(const ChromaSystem& system,
                                ThreadPool& pool,
                                ChromaParameters& parameters) {
  std::vector<char> seen(system.count(), 0);
  for (int64_t i = 0; i < system.count(); ++i) {
    const double weight = system.seen_weight()[i];
    const double a = system.target_sum()[2 * i] / weight,
                 b = system.target_sum()[2 * i + 1] / weight;
    if (!(weight >= kMinSeenWeight) || !std::isfinite(a) || !std::isfinite(b)) continue;
    seen[i] = 1;
    parameters.Row(0, 0)[i] = static_cast<float>(a / kShDc);
    parameters.Row(1, 0)[i] = static_cast<float>(b / kShDc);
  }
  FillUnseen(seen, pool, parameters);
  return seen;
}

std::vector<float> MeanConfidence(const ChromaSystem& system, const std::vector<char>& seen) {
  std::vector<float> mean(system.count(), 0.0f);
  for (int64_t i = 0; i < system.count(); ++i) {
    if (seen[i] == 0) continue;
    const double share = system.confidence_sum()[i] / system.seen_weight()[i];
    mean[i] = static_cast<float>(std::clamp(share, 0.0, 1.0));
  }
  return mean;
}

void FillUnseen(const std::vector<char>& seen, ThreadPool& pool, ChromaParameters& parameters) {
  const ParameterBlock& p = parameters.block;
  std::vector<NeighborTree::Point> points;
  std::vector<int64_t> index_of;
  for (int64_t i = 0; i < p.count(); ++i) {
    if (!seen[i]) continue;
    points.push_back(PositionOf(p, i));
    index_of.push_back(i);
  }
  if (points.empty() || static_cast<int64_t>(points.size()) == p.count()) return;
  const NeighborTree tree(std::move(points));
  pool.ForRanges(p.count(), [&](int64_t begin, int64_t end, int) {
    std::vector<NeighborTree::Neighbor> near;
    for (int64_t i = begin; i < end; ++i) {
      if (seen[i]) continue;
      tree.Find(PositionOf(p, i), kFillNeighbors, near);
      double total = 0.0, a = 0.0, b = 0.0;
      for (const NeighborTree::Neighbor& neighbor : near) {
        const double weight = 1.0 / (1e-12 + neighbor.squared_distance);
        const int64_t j = index_of[neighbor.index];
        total += weight;
        a += weight * parameters.Row(0, 0)[j];
        b += weight * parameters.Row(1, 0)[j];
      }
      if (!(total > 0.0) || !std::isfinite(a / total) || !std::isfinite(b / total)) continue;
      parameters.Row(0, 0)[i] = static_cast<float>(a / total);
      parameters.Row(1, 0)[i] = static_cast<float>(b / total);
    }
  });
}

}  // namespace color3d
