#include "core/keyview/select.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "core/base/error.h"
#include "core/base/median.h"
#include "core/base/parallel.h"
#include "core/base/range_check.h"
#include "core/catalogue/limits.h"

namespace color3d {
namespace {

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr double kGuardDeviations = 2.0;  // STILL.md "Stage 1a": median - 2 MAD
// Minimum deviation: near-identical views have a MAD of almost 0, due to rounding.
constexpr double kGuardSlack = 1e-6;
constexpr int kGuardMinViews = 5;
constexpr Eigen::Index kTile = 64;

bool IsUsable(const std::vector<double>& feature) {
  bool nonzero = false;
  for (double value : feature) {
    if (!std::isfinite(value)) return false;
    nonzero = nonzero || value != 0.0;
  }
  return nonzero;
}

void CheckLengths(const std::vector<std::vector<double>>& descriptors) {
  if (descriptors.empty()) throw InvalidArgument("there is no view to choose a key view from");
  for (const std::vector<double>& descriptor : descriptors) {
    if (descriptor.size() == descriptors[0].size() && !descriptor.empty()) continue;
    throw InvalidArgument("view descriptors must have one length >= 1, got {} and {}",
                          descriptors[0].size(),
                          descriptor.size());
  }
}

// One row of unit length per index.
Matrix UnitRows(const std::vector<std::vector<double>>& descriptors,
                const std::vector<int>& indices) {
  Matrix rows(indices.size(), descriptors[0].size());
  for (size_t i = 0; i < indices.size(); ++i) {
    const std::vector<double>& values = descriptors[indices[i]];
    auto row = rows.row(static_cast<Eigen::Index>(i));
    row = Eigen::Map<const Eigen::RowVectorXd>(values.data(), row.size());
    // Divides by the largest value first, so that squares neither overflow nor underflow.
    row /= row.cwiseAbs().maxCoeff();
    row /= row.norm();
  }
  return rows;
}

std::vector<int> KeptIndices(const std::vector<bool>& kept) {
  std::vector<int> indices;
  for (size_t i = 0; i < kept.size(); ++i) {
    if (kept[i]) indices.push_back(static_cast<int>(i));
  }
  return indices;
}

// Computes rows rows^T, the lower triangle in tiles. Each entry is one product, for any thread
// count.
Matrix Cosines(const Matrix& rows, ThreadPool& pool) {
  const Eigen::Index n = rows.rows();
  const Eigen::Index tiles = (n + kTile - 1) / kTile;
  Matrix cosines(n, n);
  pool.ForEach(tiles * (tiles + 1) / 2, [&](int64_t pair, int) {
    Eigen::Index i = 0;
    for (; pair > i; ++i) pair -= i + 1;
    const Eigen::Index top = i * kTile;
    const Eigen::Index left = pair * kTile;
    const Eigen::Index height = std::min(kTile, n - top);
    const Eigen::Index width = std::min(kTile, n - left);
    const Matrix tile = (rows.middleRows(top, height) * rows.middleRows(left, width).transpose())
                            .cwiseMax(-1.0)
                            .cwiseMin(1.0);
    cosines.block(top, left, height, width) = tile;
    if (pair != i) cosines.block(left, top, width, height) = tile.transpose();
  });
  // The diagonal tiles are not symmetric to the last bit.
  for (Eigen::Index i = 0; i < n; ++i) {
    cosines(i, i) = 1.0;
    for (Eigen::Index j = i / kTile * kTile; j < i; ++j) cosines(j, i) = cosines(i, j);
  }
  return cosines;
}

// H_i = -sum_j P_ij log P_ij, P = softmax(S_i / temperature), written as log Z - <S> / temperature
// with the largest similarity subtracted: exact for any temperature.
double RowEntropy(const Eigen::Ref<const Eigen::RowVectorXd>& row,
                  Eigen::Index self,
                  const KeyViewOptions& options) {
  double largest = -std::numeric_limits<double>::infinity();
  for (Eigen::Index j = 0; j < row.size(); ++j) {
    if (!(options.exclude_self && j == self)) largest = std::max(largest, row[j]);
  }
  double sum = 0.0;
  double weighted = 0.0;
  for (Eigen::Index j = 0; j < row.size(); ++j) {
    if (options.exclude_self && j == self) continue;
    const double logit = (row[j] - largest) / options.temperature;
    const double weight = std::exp(logit);
    sum += weight;
    if (weight > 0.0) weighted += weight * logit;
  }
  return sum > 0.0 ? std::log(sum) - weighted / sum : 0.0;
}

void SetAsideUnusable(const std::vector<std::vector<double>>& descriptors, GuardedViews* guarded) {
  std::string list;
  int count = 0;
  for (size_t i = 0; i < descriptors.size(); ++i) {
    if (IsUsable(descriptors[i])) continue;
    guarded->views[i].set_aside = "no usable features";
    if (++count <= 8) list += fmt::format("{}{}", list.empty() ? "" : ", ", i);
  }
  if (count == 0) return;
  if (static_cast<size_t>(count) == descriptors.size()) {
    throw InvalidArgument(
        "no view has a usable descriptor (all are zero or not finite); are the photos all black?");
  }
  guarded->warnings.push_back(fmt::format(
      "key view: {} views have a zero or non-finite descriptor and were set aside (view {}{})",
      count,
      list,
      count > 8 ? ", ..." : ""));
}

// A frame with a mean similarity far below that of its group is equally dissimilar to all others,
// which the entropy formula takes for variety.
void SetAsideOutliers(const std::vector<int>& group, GuardedViews* guarded) {
  std::vector<double> means;
  for (const int i : group) {
    const RankedView& view = guarded->views[i];
    if (view.set_aside.empty()) means.push_back(view.mean_similarity);
  }
  if (static_cast<int>(means.size()) < kGuardMinViews) return;
  const double median = Median(means);
  std::vector<double> deviations;
  for (double mean : means) deviations.push_back(std::abs(mean - median));
  const double limit = median - kGuardDeviations * Median(deviations) - kGuardSlack;
  for (const int i : group) {
    RankedView& view = guarded->views[i];
    if (view.set_aside.empty() && view.mean_similarity < limit)
      view.set_aside = "unlike the others";
  }
}

// Mean cosine to the other kept views of the group, for all views.
void FillMeanSimilarities(const std::vector<std::vector<double>>& descriptors,
                          const std::vector<int>& group,
                          GuardedViews* guarded) {
  const std::vector<bool> kept = guarded->Kept();
  std::vector<int> kept_of_group;
  for (const int i : group) {
    if (kept[i]) kept_of_group.push_back(i);
  }
  const Matrix kept_rows = UnitRows(descriptors, kept_of_group);
  const Eigen::VectorXd total = kept_rows.colwise().sum().transpose();
  const double count = static_cast<double>(kept_rows.rows());
  for (const int i : group) {
    RankedView& view = guarded->views[i];
    if (!IsUsable(descriptors[view.index])) continue;
    const double sum = UnitRows(descriptors, {view.index}).row(0).dot(total);
    const double own = kept[view.index] ? 1.0 : 0.0;
    view.mean_similarity = count - own > 0.0 ? (sum - own) / (count - own) : 1.0;
  }
}

// Indices of each group.
std::vector<std::vector<int>> Members(const std::vector<int>& groups, size_t count) {
  std::map<int, std::vector<int>> members;
  for (size_t i = 0; i < count; ++i) {
    members[groups.empty() ? 0 : groups[i]].push_back(static_cast<int>(i));
  }
  std::vector<std::vector<int>> result;
  for (auto& [group, indices] : members) result.push_back(std::move(indices));
  return result;
}

}  // namespace

void KeyViewOptions::Validate() const {
  const RangeCheck check("key view option");
  check("temperature", temperature, 1e-6, 1e6);
  check("count", count, 1, kMaxAdditionalKeyViews + 1);
}

std::vector<bool> GuardedViews::Kept() const {
  std::vector<bool> kept;
  for (const RankedView& view : views) kept.push_back(view.set_aside.empty());
  return kept;
}

GuardedViews GuardViews(const std::vector<std::vector<double>>& descriptors,
                        const std::vector<std::string>& unfit,
                        const KeyViewOptions& options,
                        const std::vector<int>& groups) {
  options.Validate();
  CheckLengths(descriptors);
  if (!groups.empty() && groups.size() != descriptors.size()) {
    throw InvalidArgument(
        "there are groups for {} views, but descriptors for {}", groups.size(), descriptors.size());
  }
  if (!unfit.empty() && unfit.size() != descriptors.size()) {
    throw InvalidArgument("there are frame checks for {} views, but descriptors for {}",
                          unfit.size(),
                          descriptors.size());
  }
  GuardedViews guarded;
  guarded.views.resize(descriptors.size());
  for (size_t i = 0; i < descriptors.size(); ++i) guarded.views[i].index = static_cast<int>(i);
  SetAsideUnusable(descriptors, &guarded);
  if (options.outlier_guard && !unfit.empty()) {
    GuardedViews fit = guarded;
    for (RankedView& view : fit.views) {
      if (view.set_aside.empty()) view.set_aside = unfit[view.index];
    }
    const std::vector<bool> kept = fit.Kept();
    if (std::find(kept.begin(), kept.end(), true) != kept.end()) guarded = std::move(fit);
  }
  for (const std::vector<int>& group : Members(groups, descriptors.size())) {
    FillMeanSimilarities(descriptors, group, &guarded);
    if (options.outlier_guard) SetAsideOutliers(group, &guarded);
  }
  return guarded;
}

std::vector<double> SoftmaxEntropies(const std::vector<std::vector<double>>& descriptors,
                                     const std::vector<bool>& kept,
                                     const KeyViewOptions& options,
                                     ThreadPool& pool) {
  options.Validate();
  CheckLengths(descriptors);
  const std::vector<int> indices = KeptIndices(kept);
  const Matrix cosines = Cosines(UnitRows(descriptors, indices), pool);
  std::vector<double> entropies(descriptors.size(), 0.0);
  pool.ForEach(static_cast<int64_t>(indices.size()), [&](int64_t i, int) {
    entropies[indices[i]] = RowEntropy(cosines.row(i), i, options);
  });
  return entropies;
}

KeyViewSelection RankViews(GuardedViews guarded, const std::vector<double>& scores) {
  if (scores.size() != guarded.views.size()) {
    throw InvalidArgument(
        "there are scores for {} views, expected {}", scores.size(), guarded.views.size());
  }
  std::vector<double> kept_scores;
  for (RankedView& view : guarded.views) {
    if (!view.set_aside.empty()) continue;
    view.score = scores[view.index];
    if (!std::isfinite(view.score)) {
      throw InvalidArgument("the score of view {} is not finite", view.index);
    }
    kept_scores.push_back(view.score);
  }
  std::stable_sort(
      guarded.views.begin(), guarded.views.end(), [](const RankedView& x, const RankedView& y) {
        if (x.set_aside.empty() != y.set_aside.empty()) return x.set_aside.empty();
        return x.score > y.score;
      });
  KeyViewSelection selection;
  selection.index = guarded.views[0].index;
  if (kept_scores.size() > 1) {
    selection.margin = guarded.views[0].score - guarded.views[1].score;
    const double spread = guarded.views[0].score - Median(kept_scores);
    selection.decisiveness = spread > 0.0 ? std::min(1.0, selection.margin / spread) : 0.0;
  }
  selection.ranking = std::move(guarded.views);
  selection.warnings = std::move(guarded.warnings);
  return selection;
}

}  // namespace color3d
