#include "core/scene/sfm/photo_similarity.h"

#include "core/image/feature_matches.h"

namespace color3d {

int CountMutualMatches(const LocalFeatures& a, const LocalFeatures& b) {
  return static_cast<int>(MutualMatches(a, b).size());
}

SimilarityTable CompareAll(const std::vector<LocalFeatures>& photos,
                           ThreadPool& pool,
                           const CancellationToken& cancel) {
  const int count = static_cast<int>(photos.size());
  SimilarityTable table(count);
  pool.ForEach(count, [&](int64_t i, int) {
    cancel.ThrowIfCancelled();
    for (int j = static_cast<int>(i) + 1; j < count; ++j) {
      table.Set(
          static_cast<int>(i), j, static_cast<float>(CountMutualMatches(photos[i], photos[j])));
    }
  });
  return table;
}

}  // namespace color3d
