// Similarity of photos, from a few local features each. Pure functions, thread-safe. For this
// folder only.
#pragma once

#include <utility>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/parallel.h"
#include "core/image/local_features.h"

namespace color3d {

// Symmetric n x n table with zeros on the diagonal.
class SimilarityTable {
 public:
  explicit SimilarityTable(int count = 0)
      : count_(count), values_(static_cast<size_t>(count) * count, 0.0f) {}
  int count() const { return count_; }
  float At(int i, int j) const { return values_[static_cast<size_t>(i) * count_ + j]; }
  void Set(int i, int j, float value) {
    values_[static_cast<size_t>(i) * count_ + j] = value;
    values_[static_cast<size_t>(j) * count_ + i] = value;
  }

 private:
  int count_ = 0;
  std::vector<float> values_;
};

// Number of MutualMatches.
int CountMutualMatches(const LocalFeatures& a, const LocalFeatures& b);

// Counts matches of every pair by pre-emptive matching (Wu 2013, "Towards linear-time incremental
// structure from motion"). Cost: n^2 / 2 pairs of about 1 ms. Checks `cancel` for every photo.
SimilarityTable CompareAll(const std::vector<LocalFeatures>& photos,
                           ThreadPool& pool,
                           const CancellationToken& cancel);

}  // namespace color3d
