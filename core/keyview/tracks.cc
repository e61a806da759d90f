#include "core/keyview/tracks.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/base/error.h"
#include "core/base/median.h"

namespace color3d {
namespace {

// Maximum number of additions to the counts of shared points; above, points are subsampled.
constexpr double kWorkBudget = 5e8;
// Minimum number of points of a view for a reliable comparison.
constexpr int kFewPoints = 20;

int64_t StrideFor(const std::vector<std::vector<int>>& tracks) {
  double work = 0.0;
  for (const auto& track : tracks) work += static_cast<double>(track.size()) * track.size();
  return 1 + static_cast<int64_t>(work / kWorkBudget);
}

void CheckTrack(const std::vector<int>& track, size_t views) {
  for (int view : track) {
    if (view >= 0 && static_cast<size_t>(view) < views) continue;
    throw InvalidArgument("a track refers to view {}, but the scene has {} views", view, views);
  }
}

}  // namespace

std::vector<double> TrackCoverage(const std::vector<std::vector<int>>& tracks,
                                  const std::vector<bool>& kept) {
  const size_t n = kept.size();
  // shared[i * n + j]: number of points that both i and j see; on the diagonal, those of each view.
  std::vector<uint32_t> shared(n * n, 0);
  const int64_t stride = StrideFor(tracks);
  for (size_t p = 0; p < tracks.size(); p += static_cast<size_t>(stride)) {
    CheckTrack(tracks[p], n);
    for (int i : tracks[p]) {
      for (int j : tracks[p]) ++shared[i * n + j];
    }
  }
  std::vector<double> scores(n, 0.0);
  for (size_t i = 0; i < n; ++i) {
    if (!kept[i]) continue;
    double sum = 0.0;
    int others = 0;
    for (size_t j = 0; j < n; ++j) {
      const uint32_t own = shared[j * n + j];
      if (!kept[j] || j == i || own == 0) continue;
      sum += std::sqrt(static_cast<double>(shared[i * n + j]) / own);
      ++others;
    }
    scores[i] = others > 0 ? sum / others : 0.0;
  }
  return scores;
}

std::string UnusableTracksReason(const std::vector<std::vector<int>>& tracks,
                                 const std::vector<bool>& kept) {
  std::vector<double> points(kept.size(), 0.0);
  for (const auto& track : tracks) {
    CheckTrack(track, kept.size());
    if (track.size() < 2) continue;
    for (int view : track) points[view] += 1.0;
  }
  std::vector<double> of_kept;
  for (size_t i = 0; i < kept.size(); ++i) {
    if (kept[i]) of_kept.push_back(points[i]);
  }
  if (of_kept.empty()) return "there is no view";
  const double median = Median(of_kept);
  if (median >= kFewPoints) return "";
  return "half of the views have fewer than " + std::to_string(kFewPoints) +
         " points that another view sees too";
}

}  // namespace color3d
