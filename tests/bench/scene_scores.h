// Scores of a set of pictures beside ScorePictures: agreement of the views on common matches, and
// the perceptual scores of networks whose weights the user provides (FID, LPIPS to the reference,
// CLIP score). Pure but for reading files, thread-safe.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/parallel.h"
#include "core/metrics/consistency.h"
#include "tests/bench/picture_scores.h"

namespace color3d {

struct PerceptualOptions {
  std::string fid_weights;        // files; empty: not given
  bool allow_biased_fid = false;  // with too few pictures
  std::string lpips_weights;
  std::string lpips_linear;
  std::string reference;  // the coloured key view
  std::string clip_weights;
  std::string prompt;
  // Throws Error{kInvalidArgument} for options of which another one is missing.
  void Validate() const;
};

struct PerceptualScores {
  std::optional<double> fid;
  bool fid_is_biased = false;
  // Of the views, in their order: "ref_lpips", "clip_score".
  std::map<std::string, std::vector<double>> of_views;
  // Reason by name of each score that was left out.
  std::map<std::string, std::string> left_out;
};

// Throws Error{kInvalidArgument} for weights of another network.
PerceptualScores ScorePerception(const std::vector<PictureScores>& views,
                                 const PerceptualOptions& options,
                                 const CancellationToken& cancel);

// ME and TC of neighbouring pictures, in the order of `views`, on matches by optical flow of the
// photos' luminance: equal for all methods that are scored on these views.
Consistency ScoreCommonMatches(const std::vector<PictureScores>& views,
                               ThreadPool& pool,
                               const CancellationToken& cancel);

}  // namespace color3d
