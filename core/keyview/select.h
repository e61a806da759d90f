// Key view selection (STILL.md "Stage 1a"): which photo the user should colour. First views that
// must not win are set aside, then the strategy's scores rank the rest. Pure, float64, the same
// answer on every run; thread-safe.
#pragma once

#include <string>
#include <vector>

#include "core/base/parallel.h"

namespace color3d {

enum class KeyViewStrategy { kEntropy, kCoverage, kTracks, kManual };

struct KeyViewOptions {
  KeyViewStrategy strategy = KeyViewStrategy::kCoverage;
  double temperature = 1.0;   // of the softmax, 1e-6..1e6
  bool exclude_self = false;  // leave the view's similarity to itself out of the softmax
  // Set aside frames that show nothing (UnfitFrames) and, among 5 views or more, those with mean
  // similarity < median - 2 MAD.
  bool outlier_guard = true;
  // Number of views, chosen together (expected_error.h), 1..kMaxAdditionalKeyViews + 1. The
  // strategy counts for one view only.
  int count = 1;
  void Validate() const;  // throws Error{kInvalidArgument}
  bool operator==(const KeyViewOptions&) const = default;
};

struct RankedView {
  int index = 0;
  double score = 0.0;            // larger is better; 0 for views that were set aside
  double mean_similarity = 0.0;  // cosine to the other views
  std::string set_aside;         // why; empty: the view takes part
};

struct GuardedViews {
  std::vector<RankedView> views;  // by index, without scores
  std::vector<std::string> warnings;

  // One entry a view: it takes part.
  std::vector<bool> Kept() const;
};

// descriptors[i] is view i's (any length >= 1, all equal). Zero or non-finite ones are set aside in
// any case; unfit[i] (UnfitFrames; may be empty for no such check) and the similarity guard count
// when options.outlier_guard. groups[i] (may be empty: one group): views are compared with those of
// their own group, as a film's with those of their shot. Throws Error{kInvalidArgument} for no
// views, descriptors of several lengths, or when no view is left.
GuardedViews GuardViews(const std::vector<std::vector<double>>& descriptors,
                        const std::vector<std::string>& unfit,
                        const KeyViewOptions& options,
                        const std::vector<int>& groups = {});

// The paper's score of every kept view, 0 for the others: H_i = -sum_j P_ij log P_ij (nats) with P
// the row softmax of S / temperature, S the cosine similarities among the kept views. Memory grows
// with views^2: 32 MB for 2000.
std::vector<double> SoftmaxEntropies(const std::vector<std::vector<double>>& descriptors,
                                     const std::vector<bool>& kept,
                                     const KeyViewOptions& options,
                                     ThreadPool& pool);

struct KeyViewSelection {
  int index = 0;
  double margin = 0.0;  // score of the winner minus the next one's
  // The margin as a share of the distance from the winner to the median of the views that take
  // part, 0..1: how clearly the winner stands out. 1 when there is no other view.
  double decisiveness = 1.0;
  std::vector<RankedView> ranking;  // best first, ties by index; views that were set aside last
  std::vector<std::string> warnings;
};

// scores[i] is view i's. Throws Error{kInvalidArgument} when a kept view's is not finite.
KeyViewSelection RankViews(GuardedViews guarded, const std::vector<double>& scores);

}  // namespace color3d
