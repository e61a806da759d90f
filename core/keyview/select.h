// Key view selection (STILL.md "Stage 1a"): the photo that the user should colour. Excludes unfit
// views, then ranks the others by the scores of the strategy. Pure functions, float64,
// deterministic; thread-safe.
#pragma once

#include <string>
#include <vector>

#include "core/base/parallel.h"

namespace color3d {

enum class KeyViewStrategy { kEntropy, kCoverage, kTracks, kManual, kRandom };

struct KeyViewOptions {
  KeyViewStrategy strategy = KeyViewStrategy::kCoverage;
  double temperature = 1.0;   // of the softmax, 1e-6..1e6
  bool exclude_self = false;  // exclude the view's similarity to itself from the softmax
  // Exclude unfit frames (UnfitFrames) and, among at least 5 views, those with mean similarity
  // below median - 2 MAD.
  bool outlier_guard = true;
  // Number of views, chosen together (expected_error.h), 1..kMaxAdditionalKeyViews + 1. The
  // strategy applies to a single view only.
  int count = 1;
  void Validate() const;  // throws Error{kInvalidArgument}
  bool operator==(const KeyViewOptions&) const = default;
};

struct RankedView {
  int index = 0;
  double score = 0.0;            // larger is better; 0 for excluded views
  double mean_similarity = 0.0;  // mean cosine to the other views
  std::string set_aside;         // reason for exclusion; empty: the view takes part
};

struct GuardedViews {
  std::vector<RankedView> views;  // by index, without scores
  std::vector<std::string> warnings;

  // Per view: whether it takes part.
  std::vector<bool> Kept() const;
};

// Excludes views. descriptors[i]: descriptor of view i (any length >= 1, all equal); zero or
// non-finite ones are always excluded. unfit[i] (UnfitFrames; empty: no such check) and the
// similarity guard apply if options.outlier_guard. groups[i] (empty: one group): views are compared
// within their group, as those of a film within their shot. Throws Error{kInvalidArgument} if there
// are no views, descriptors have different lengths, or no view remains.
GuardedViews GuardViews(const std::vector<std::vector<double>>& descriptors,
                        const std::vector<std::string>& unfit,
                        const KeyViewOptions& options,
                        const std::vector<int>& groups = {});

// Returns the paper's score of every kept view, 0 for the others: H_i = -sum_j P_ij log P_ij (nats)
// with P the row softmax of S / temperature, S the cosine similarities among the kept views. Memory
// grows with views^2: 32 MB for 2000.
std::vector<double> SoftmaxEntropies(const std::vector<std::vector<double>>& descriptors,
                                     const std::vector<bool>& kept,
                                     const KeyViewOptions& options,
                                     ThreadPool& pool);

struct KeyViewSelection {
  int index = 0;
  double margin = 0.0;  // score of the winner minus that of the second
  // Margin relative to the distance from the winner to the median of all views that take part,
  // 0..1; 1 if there is no other view.
  double decisiveness = 1.0;
  std::vector<RankedView> ranking;  // best first, ties by index; excluded views last
  std::vector<std::string> warnings;
};

// scores[i]: score of view i. Throws Error{kInvalidArgument} if that of a kept view is not finite.
KeyViewSelection RankViews(GuardedViews guarded, const std::vector<double>& scores);

}  // namespace color3d
