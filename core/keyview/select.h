// Key view selection (METHOD.md "Stage 1a"): which photo the user should colour. Pure, float64.
#pragma once

#include <string>
#include <vector>

namespace color3d {

enum class KeyViewStrategy { kEntropy, kCoverage, kManual };

struct KeyViewOptions {
  KeyViewStrategy strategy = KeyViewStrategy::kCoverage;
  double temperature = 1.0;   // of the softmax, > 0
  bool exclude_self = false;  // leave the view's similarity to itself out of the softmax
  bool outlier_guard = true;  // set aside views with mean similarity < median - 2 MAD
  int manual_index = -1;      // for kManual: the chosen view
  void Validate(int view_count) const;
};

struct RankedView {
  int index = 0;
  double score = 0.0;            // entropy (nats), or minus the mean nearest-feature distance
  double mean_similarity = 0.0;  // cosine to the other views
  bool set_aside = false;        // by the outlier guard
};

struct KeyViewSelection {
  int index = 0;
  double margin = 0.0;              // score of the winner minus the next one's
  std::vector<RankedView> ranking;  // best first; views that were set aside last
  std::vector<std::string> warnings;
};

// features[i] is view i's descriptor (any length >= 1, all equal). H_i = -sum_j P_ij log P_ij with
// P the row softmax of S / temperature, S the cosine similarities; ties to the lowest index. Zero
// or non-finite descriptors are set aside with a warning. Throws Error{kInvalidArgument} for no
// views or when no descriptor is usable.
KeyViewSelection SelectKeyViewByEntropy(const std::vector<std::vector<double>>& features,
                                        const KeyViewOptions& options);

// mean_distance[i][j]: how badly view i explains view j (mean nearest-neighbour distance of j's
// deep features to i's). Chooses the row with the smallest mean over j != i.
KeyViewSelection SelectKeyViewByCoverage(const std::vector<std::vector<double>>& mean_distance,
                                         const std::vector<std::vector<double>>& features,
                                         const KeyViewOptions& options);

}  // namespace color3d
