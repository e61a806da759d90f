// Scores of any method's pictures against true colours: the score of the benchmark card
// (tests/bench/BENCHMARK.md). Pure but for reading files, thread-safe.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/parallel.h"

namespace color3d {

struct PictureScores {
  std::string view;                      // stem of the file
  std::map<std::string, double> scores;  // ScoreView (core/metrics/view_scores.h)
  std::filesystem::path photo;
  std::filesystem::path picture;
};

// Pairs the pictures with the photos of the same stem, and scores each at the size of ScoreView.
// `views`: stems or names of the scored photos; empty: those that have a picture. Throws
// Error{kInvalidArgument} that names the file if a scored view has no picture, a picture has no
// photo or another shape than it (by more than 2 %), two files share a stem, or a photo is grey.
std::vector<PictureScores> ScorePictures(const std::filesystem::path& truth,
                                         const std::filesystem::path& pictures,
                                         const std::vector<std::string>& views,
                                         ThreadPool& pool,
                                         const CancellationToken& cancel);

}  // namespace color3d
