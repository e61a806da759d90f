#include "core/keyview/select.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/base/error.h"

namespace color3d {
namespace {

using Matrix = std::vector<std::vector<double>>;

constexpr double kGuardDeviations = 2.0;  // METHOD.md "Stage 1a": median - 2 MAD
// Rounding is no deviation: near-identical views have a MAD of almost nothing.
constexpr double kGuardSlack = 1e-6;
constexpr int kGuardMinViews = 5;

bool IsUsable(const std::vector<double>& feature) {
  bool nonzero = false;
  for (double value : feature) {
    if (!std::isfinite(value)) return false;
    nonzero = nonzero || value != 0.0;
  }
  return nonzero;
}

// Rows of unit length; unusable ones become empty.
Matrix Normalised(const Matrix& features) {
  Matrix rows;
  for (const std::vector<double>& feature : features) {
    if (feature.size() != features[0].size() || feature.empty()) {
      throw InvalidArgument("view descriptors must have one length >= 1, got " +
                            std::to_string(features[0].size()) + " and " +
                            std::to_string(feature.size()));
    }
    if (!IsUsable(feature)) {
      rows.emplace_back();
      continue;
    }
    // Divided by the largest value first, so that squares neither overflow nor vanish.
    double largest = 0.0;
    for (double value : feature) largest = std::max(largest, std::abs(value));
    double squares = 0.0;
    for (double value : feature) squares += (value / largest) * (value / largest);
    const double norm = std::sqrt(squares);
    std::vector<double> row(feature.size());
    for (size_t i = 0; i < row.size(); ++i) row[i] = feature[i] / largest / norm;
    rows.push_back(std::move(row));
  }
  return rows;
}

double Dot(const std::vector<double>& x, const std::vector<double>& y) {
  return std::inner_product(x.begin(), x.end(), y.begin(), 0.0);
}

std::string ListOf(const std::vector<int>& indices) {
  std::string text;
  for (size_t i = 0; i < indices.size() && i < 8; ++i) {
    text += (i ? ", " : "") + std::to_string(indices[i]);
  }
  return indices.size() > 8 ? text + ", ..." : text;
}

double Median(std::vector<double> values) {
  const size_t middle = values.size() / 2;
  std::nth_element(values.begin(), values.begin() + middle, values.end());
  if (values.size() % 2 == 1) return values[middle];
  const double upper = values[middle];
  return 0.5 * (upper + *std::max_element(values.begin(), values.begin() + middle));
}

struct Similarities {
  std::vector<int> usable;  // view indices
  Matrix cosine;            // usable x usable
  std::vector<double> mean_to_others;
};

Similarities ComputeSimilarities(const Matrix& features) {
  const Matrix rows = Normalised(features);
  Similarities result;
  for (size_t i = 0; i < rows.size(); ++i) {
    if (!rows[i].empty()) result.usable.push_back(static_cast<int>(i));
  }
  const size_t n = result.usable.size();
  result.cosine.assign(n, std::vector<double>(n, 1.0));
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = 0; j < i; ++j) {
      const double cosine =
          std::clamp(Dot(rows[result.usable[i]], rows[result.usable[j]]), -1.0, 1.0);
      result.cosine[i][j] = result.cosine[j][i] = cosine;
    }
  }
  for (size_t i = 0; i < n; ++i) {
    const double sum = std::accumulate(result.cosine[i].begin(), result.cosine[i].end(), 0.0) - 1.0;
    result.mean_to_others.push_back(n > 1 ? sum / static_cast<double>(n - 1) : 1.0);
  }
  return result;
}

// H_i = -sum_j P_ij log P_ij, P = softmax(S_i / temperature), written as log Z - <S> / temperature
// with the largest similarity taken out: exact for any temperature.
double RowEntropy(const std::vector<double>& row, size_t self, const KeyViewOptions& options) {
  double largest = -std::numeric_limits<double>::infinity();
  for (size_t j = 0; j < row.size(); ++j) {
    if (!(options.exclude_self && j == self)) largest = std::max(largest, row[j]);
  }
  double sum = 0.0;
  double weighted = 0.0;
  for (size_t j = 0; j < row.size(); ++j) {
    if (options.exclude_self && j == self) continue;
    const double logit = (row[j] - largest) / options.temperature;
    const double weight = std::exp(logit);
    sum += weight;
    if (weight > 0.0) weighted += weight * logit;
  }
  return sum > 0.0 ? std::log(sum) - weighted / sum : 0.0;
}

// Marks views whose mean similarity to the others lies far below the rest's (an outlier frame:
// lens cap, blur). It is equally unlike all others, which the entropy formula takes for variety.
void ApplyOutlierGuard(std::vector<RankedView>& views, std::vector<std::string>& warnings) {
  std::vector<double> means;
  for (const RankedView& view : views) {
    if (!view.set_aside) means.push_back(view.mean_similarity);
  }
  if (static_cast<int>(means.size()) < kGuardMinViews) return;
  const double median = Median(means);
  std::vector<double> deviations;
  for (double mean : means) deviations.push_back(std::abs(mean - median));
  const double limit = median - kGuardDeviations * Median(deviations) - kGuardSlack;
  std::vector<int> rejected;
  for (RankedView& view : views) {
    if (view.set_aside || view.mean_similarity >= limit) continue;
    view.set_aside = true;
    rejected.push_back(view.index);
  }
  if (!rejected.empty()) {
    warnings.push_back("key view: " + std::to_string(rejected.size()) +
                       " views are unlike the others and were set aside");
  }
}

std::vector<RankedView> UsableViews(const Similarities& similarities,
                                    size_t view_count,
                                    std::vector<std::string>& warnings) {
  if (similarities.usable.empty()) {
    throw InvalidArgument(
        "no view has a usable descriptor (all are zero or not finite); are the photos all black?");
  }
  std::vector<RankedView> views(view_count);
  std::vector<int> unusable;
  for (size_t i = 0; i < view_count; ++i) {
    views[i].index = static_cast<int>(i);
    views[i].set_aside = true;
  }
  for (size_t i = 0; i < similarities.usable.size(); ++i) {
    RankedView& view = views[similarities.usable[i]];
    view.set_aside = false;
    view.mean_similarity = similarities.mean_to_others[i];
  }
  for (const RankedView& view : views) {
    if (view.set_aside) unusable.push_back(view.index);
  }
  if (!unusable.empty()) {
    warnings.push_back("key view: " + std::to_string(unusable.size()) +
                       " views have a zero or non-finite descriptor and were set aside (view " +
                       ListOf(unusable) + ")");
  }
  return views;
}

KeyViewSelection Rank(std::vector<RankedView> views,
                      const KeyViewOptions& options,
                      std::vector<std::string> warnings) {
  std::stable_sort(views.begin(), views.end(), [](const RankedView& x, const RankedView& y) {
    if (x.set_aside != y.set_aside) return y.set_aside;
    return x.score > y.score;
  });
  if (options.strategy == KeyViewStrategy::kManual) {
    const auto chosen = std::find_if(views.begin(), views.end(), [&](const RankedView& view) {
      return view.index == options.manual_index;
    });
    if (chosen->set_aside) warnings.push_back("key view: the chosen view is unlike all others");
    std::rotate(views.begin(), chosen, chosen + 1);
  }
  KeyViewSelection selection;
  selection.index = views[0].index;
  if (views.size() > 1 && !views[1].set_aside) selection.margin = views[0].score - views[1].score;
  selection.ranking = std::move(views);
  selection.warnings = std::move(warnings);
  return selection;
}

}  // namespace

void KeyViewOptions::Validate(int view_count) const {
  if (view_count < 1) throw InvalidArgument("there is no view to choose a key view from");
  if (!(temperature > 0.0) || !std::isfinite(temperature)) {
    throw InvalidArgument("key view option temperature is " + std::to_string(temperature) +
                          ", it must be > 0");
  }
  if (strategy == KeyViewStrategy::kManual && (manual_index < 0 || manual_index >= view_count)) {
    throw InvalidArgument("key view option manual_index is " + std::to_string(manual_index) +
                          ", the scene has views 0 to " + std::to_string(view_count - 1));
  }
}

KeyViewSelection SelectKeyViewByEntropy(const std::vector<std::vector<double>>& features,
                                        const KeyViewOptions& options) {
  options.Validate(static_cast<int>(features.size()));
  const Similarities similarities = ComputeSimilarities(features);
  std::vector<std::string> warnings;
  std::vector<RankedView> views = UsableViews(similarities, features.size(), warnings);
  for (size_t i = 0; i < similarities.usable.size(); ++i) {
    views[similarities.usable[i]].score = RowEntropy(similarities.cosine[i], i, options);
  }
  if (options.outlier_guard) ApplyOutlierGuard(views, warnings);
  return Rank(std::move(views), options, std::move(warnings));
}

KeyViewSelection SelectKeyViewByCoverage(const std::vector<std::vector<double>>& mean_distance,
                                         const std::vector<std::vector<double>>& features,
                                         const KeyViewOptions& options) {
  const size_t n = features.size();
  options.Validate(static_cast<int>(n));
  if (mean_distance.size() != n) {
    throw InvalidArgument("coverage has distances for " + std::to_string(mean_distance.size()) +
                          " views and descriptors for " + std::to_string(n));
  }
  const Similarities similarities = ComputeSimilarities(features);
  std::vector<std::string> warnings;
  std::vector<RankedView> views = UsableViews(similarities, n, warnings);
  for (RankedView& view : views) {
    if (mean_distance[view.index].size() != n) {
      throw InvalidArgument("the coverage matrix of " + std::to_string(n) + " views has a row of " +
                            std::to_string(mean_distance[view.index].size()));
    }
    if (view.set_aside) continue;
    double sum = 0.0;
    int count = 0;
    for (int other : similarities.usable) {
      if (other == view.index) continue;
      sum += mean_distance[view.index][other];
      ++count;
    }
    view.score = count > 0 ? -sum / count : 0.0;
    if (!std::isfinite(view.score)) {
      throw InvalidArgument("the coverage of view " + std::to_string(view.index) +
                            " is not finite");
    }
  }
  if (options.outlier_guard) ApplyOutlierGuard(views, warnings);
  return Rank(std::move(views), options, std::move(warnings));
}

}  // namespace color3d
