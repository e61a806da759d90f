#include "tests/bench/scene_scores.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/encoder/clip/clip.h"
#include "core/encoder/inception/inception.h"
#include "core/encoder/lpips/lpips.h"
#include "core/image/codec.h"
#include "core/metrics/flow_matches.h"
#include "core/metrics/frechet_distance.h"
#include "core/metrics/view_scores.h"

namespace color3d {
namespace {

constexpr int kMaxPairs = 24;  // for each gap
constexpr int kStridePx = 3;

Image SmallPicture(const std::filesystem::path& file) {
  return FitWithin(ReadImage(file), kScoreSidePx);
}

void ScoreFid(const std::vector<PictureScores>& views,
              const PerceptualOptions& options,
              const CancellationToken& cancel,
              PerceptualScores* scores) {
  if (options.fid_weights.empty()) {
    scores->left_out["fid"] = "no weights of Inception v3 (--fid-weights)";
    return;
  }
  const auto network = Inception::FromWeightFile(options.fid_weights);
  // The covariance of n samples has rank n - 1.
  const bool too_few = std::ssize(views) <= network->feature_count();
  if (views.size() < 2 || (too_few && !options.allow_biased_fid)) {
    scores->left_out["fid"] = fmt::format(
        "{} pictures, but the covariance of {} features needs more than {}; fewer bias it upwards "
        "(--biased-fid computes it from 2 pictures and more)",
        views.size(),
        network->feature_count(),
        network->feature_count());
    return;
  }
  std::vector<std::vector<float>> photos, pictures;
  for (const PictureScores& view : views) {
    cancel.ThrowIfCancelled();
    photos.push_back(network->Features(ReadImage(view.photo)));
    pictures.push_back(network->Features(ReadImage(view.picture)));
  }
  scores->fid = FrechetDistance(photos, pictures);
  scores->fid_is_biased = too_few;
}

void ScoreReference(const std::vector<PictureScores>& views,
                    const PerceptualOptions& options,
                    const CancellationToken& cancel,
                    PerceptualScores* scores) {
  if (options.lpips_weights.empty()) {
    scores->left_out["ref_lpips"] =
        "no weights of LPIPS (--lpips-weights, --lpips-linear, --reference)";
    return;
  }
  const auto lpips = Lpips::FromWeightFiles(options.lpips_weights, options.lpips_linear);
  const Image reference = SmallPicture(options.reference);
  for (const PictureScores& view : views) {
    cancel.ThrowIfCancelled();
    const Image picture = Resize(ReadImage(view.picture), reference.width, reference.height);
    scores->of_views["ref_lpips"].push_back(lpips->Distance(picture, reference));
  }
}

void ScorePrompt(const std::vector<PictureScores>& views,
                 const PerceptualOptions& options,
                 const CancellationToken& cancel,
                 PerceptualScores* scores) {
  if (options.clip_weights.empty()) {
    scores->left_out["clip_score"] = "no weights of CLIP (--clip-weights, --prompt)";
    return;
  }
  const auto clip = ClipModel::FromWeightFile(options.clip_weights);
  for (const PictureScores& view : views) {
    cancel.ThrowIfCancelled();
    scores->of_views["clip_score"].push_back(
        clip->Score(ReadImage(view.picture), options.prompt).score);
  }
}

// Picture of a view and the luminance of its photo, in one size.
struct MatchedView {
  Image luminance;
  ColoredPicture picture;
};

MatchedView ReadMatchedView(const PictureScores& view) {
  const Image photo = SmallPicture(view.photo);
  MatchedView matched;
  matched.luminance = LuminanceOfLab(LabFromSrgb(photo));
  Image given = Resize(ReadImage(view.picture), photo.width, photo.height);
  if (given.channels == 1) {
    Image color(given.width, given.height, 3);
    for (int c = 0; c < 3; ++c) std::copy_n(given.Plane(0), given.PlaneSize(), color.Plane(c));
    given = std::move(color);
  }
  matched.picture.lab = LabFromSrgb(given);
  matched.picture.srgb = std::move(given);
  return matched;
}

}  // namespace

void PerceptualOptions::Validate() const {
  const auto require_all = [](const std::vector<std::pair<const char*, bool>>& given) {
    const auto is_given = [](const auto& option) { return option.second; };
    const auto missing = std::ranges::find_if_not(given, is_given);
    if (missing == given.end() || std::ranges::none_of(given, is_given)) return;
    throw InvalidArgument("{} is missing; give it or leave out {}",
                          missing->first,
                          std::ranges::find_if(given, is_given)->first);
  };
  require_all({{"--lpips-weights", !lpips_weights.empty()},
               {"--lpips-linear", !lpips_linear.empty()},
               {"--reference", !reference.empty()}});
  require_all({{"--clip-weights", !clip_weights.empty()}, {"--prompt", !prompt.empty()}});
  if (allow_biased_fid && fid_weights.empty()) {
    throw InvalidArgument("--fid-weights is missing; give it or leave out --biased-fid");
  }
}

PerceptualScores ScorePerception(const std::vector<PictureScores>& views,
                                 const PerceptualOptions& options,
                                 const CancellationToken& cancel) {
  options.Validate();
  PerceptualScores scores;
  ScoreFid(views, options, cancel, &scores);
  ScoreReference(views, options, cancel, &scores);
  ScorePrompt(views, options, cancel, &scores);
  return scores;
}

Consistency ScoreCommonMatches(const std::vector<PictureScores>& views,
                               ThreadPool& pool,
                               const CancellationToken& cancel) {
  const auto pairs = ConsistencyPairs({static_cast<int>(views.size())}, kMaxPairs);
  std::vector<PairDifference> differences(pairs.size());
  pool.ForEach(static_cast<int64_t>(pairs.size()), [&](int64_t i, int) {
    cancel.ThrowIfCancelled();
    const MatchedView from = ReadMatchedView(views[pairs[i].first]);
    const MatchedView to = ReadMatchedView(views[pairs[i].second]);
    differences[i] = CompareMatches(
        from.picture, to.picture, MatchByFlow(from.luminance, to.luminance, kStridePx));
  });
  ConsistencyMeter meter;
  for (size_t i = 0; i < pairs.size(); ++i) meter.Add(pairs[i], differences[i]);
  return meter.Result();
}

}  // namespace color3d
