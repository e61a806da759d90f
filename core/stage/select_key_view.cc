#include <fmt/format.h>

#include <algorithm>

#include "core/base/random.h"
#include "core/color/lab.h"
#include "core/encoder/encoder.h"
#include "core/image/codec.h"
#include "core/keyview/collect_features.h"
#include "core/keyview/coverage.h"
#include "core/keyview/expected_error.h"
#include "core/keyview/tracks.h"
#include "core/scene/key_photo.h"
#include "core/stage/film/film_keys.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/key_view_ranking.h"
#include "core/stage/run_stages.h"
#include "core/stage/sources/seen_samples.h"

namespace color3d {
namespace {

const char* StrategyName(KeyViewStrategy strategy) {
  switch (strategy) {
    case KeyViewStrategy::kEntropy:
      return "entropy";
    case KeyViewStrategy::kTracks:
      return "tracks";
    case KeyViewStrategy::kManual:
      return "manual";
    case KeyViewStrategy::kRandom:
      return "random";
    case KeyViewStrategy::kCoverage:
      break;
  }
  return "coverage";
}

// For each sparse point the candidates that see it. Empty if the points are synthetic.
std::vector<std::vector<int>> TracksOf(const Scene& scene,
                                       const std::vector<int>& candidates,
                                       const StageContext& context) {
  if (context.HasInput(artifact::kImportFacts) &&
      ImportFactsFromJson(context.ReadInput(artifact::kImportFacts)).random_points) {
    return {};
  }
  std::vector<int> candidate_of(scene.views.size(), -1);
  for (size_t i = 0; i < candidates.size(); ++i) candidate_of[candidates[i]] = static_cast<int>(i);
  std::vector<std::vector<int>> tracks;
  for (const SparsePoint& point : scene.points) {
    tracks.emplace_back();
    for (int view : point.views) {
      if (candidate_of.at(view) >= 0) tracks.back().push_back(candidate_of[view]);
    }
  }
  return tracks;
}

std::vector<double> CoverageScores(const std::vector<ViewFeatures>& features,
                                   const std::vector<bool>& kept,
                                   StageContext& context) {
  std::vector<double> scores = MeanFeatureDistances(features, kept, context.control());
  for (double& score : scores) score = -score;
  return scores;
}

// A uniform number for each candidate, by the seed of the run.
std::vector<double> RandomScores(size_t candidates, uint64_t seed) {
  Random random(seed);
  std::vector<double> scores(candidates);
  for (double& score : scores) score = random.NextUniform();
  return scores;
}

void ChooseManually(const std::string& name,
                    const Scene& scene,
                    const std::vector<int>& candidates,
                    KeyViewRanking* ranking) {
  const int view = scene.FindView(name);
  const auto found = std::ranges::find(candidates, view);
  if (found == candidates.end()) {
    throw InvalidArgument("the view {} is held out for evaluation and cannot be the key view",
                          scene.views[view].name);
  }
  ranking->selection.index = static_cast<int>(found - candidates.begin());
  if (ranking->selection.ranking.empty()) {
    ranking->selection.ranking = {{ranking->selection.index, 0.0, 0.0, ""}};
  }
}

// Selects several key views. A view that the user names remains the first. Visibility between views
// comes from the geometry of an earlier job, if there is one.
void ChooseKeyViewSet(const SelectKeyViewOptions& options,
                      const Scene& scene,
                      const std::vector<int>& candidates,
                      const std::vector<bool>& kept,
                      bool is_film,
                      StageContext& context,
                      KeyViewRanking* ranking) {
  int first = -1;
  if (options.selection.strategy == KeyViewStrategy::kManual) {
    ChooseManually(options.view, scene, candidates, ranking);
    first = ranking->selection.index;
  }
  if (is_film) {
    ChosenKeyViews chosen = ChooseFilmKeys(
        scene, candidates, ranking->features, kept, options.selection.count, first, context);
    ranking->selection.index = chosen.views[0];
    ranking->together = std::move(chosen.views);
    ranking->expected_error = std::move(chosen.error);
    return;
  }
  const NearestDistances distances =
      FindNearestDistances(ranking->features, kept, context.control());
  const SeenSamples seen =
      context.HasInput(artifact::kGeometry)
          ? SeenByGeometry(scene,
                           candidates,
                           ParseGaussians(context.ReadInput(artifact::kGeometry)),
                           GridFor(static_cast<int>(candidates.size())),
                           context.pool(),
                           context.cancel())
      : TracksOf(scene, candidates, context).empty()
          ? SeenSamples(static_cast<int>(candidates.size()), 0)
          : SeenByPoints(scene, candidates);
  ChosenKeyViews chosen = ChooseKeyViews(seen, distances, kept, options.selection.count, first);
  ranking->selection.index = chosen.views[0];
  ranking->together = std::move(chosen.views);
  ranking->expected_error = std::move(chosen.error);
}

void ChooseByScore(const SelectKeyViewOptions& stage_options,
                   const Scene& scene,
                   const std::vector<int>& candidates,
                   bool is_film,
                   StageContext& context,
                   KeyViewRanking* ranking) {
  std::vector<std::filesystem::path> photos;
  for (int view : candidates) {
    photos.push_back(context.scene_folder() / scene.views[view].image_file);
  }
  const KeyViewOptions& options = stage_options.selection;
  const auto encoder = context.LoadEncoder(stage_options.encoder);
  const auto describer =
      stage_options.features.empty() ? encoder : context.LoadEncoder(stage_options.features);
  ranking->encoder = encoder->description();
  if (describer != encoder) ranking->encoder += "; " + describer->description();
  ranking->features =
      CollectViewFeatures(*describer, *encoder, photos, FeatureCache(context), context.control());
  std::vector<std::vector<double>> descriptors;
  std::vector<FrameContent> contents;
  for (const ViewFeatures& view : ranking->features) {
    descriptors.push_back(view.descriptor);
    contents.push_back(view.content);
  }
  std::vector<int> shots;  // shots of a film
  if (is_film) {
    for (const int view : candidates) shots.push_back(scene.views[view].moment->shot);
  }
  GuardedViews guarded = GuardViews(descriptors, UnfitFrames(contents, shots), options, shots);
  const std::vector<bool> kept = guarded.Kept();
  // A view that the user names is the first of several. The sheet lists the others by coverage.
  KeyViewStrategy strategy =
      options.strategy == KeyViewStrategy::kManual ? KeyViewStrategy::kCoverage : options.strategy;
  std::vector<double> scores;
  if (strategy == KeyViewStrategy::kTracks) {
    const auto tracks = TracksOf(scene, candidates, context);
    const std::string reason = tracks.empty() ? "the scene has no points from structure-from-motion"
                                              : UnusableTracksReason(tracks, kept);
    if (reason.empty()) {
      scores = TrackCoverage(tracks, kept);
    } else {
      strategy = KeyViewStrategy::kCoverage;
      ranking->fallback = "Coverage in place of tracks: " + reason + ".";
      context.Warn("key view: {}", ranking->fallback);
    }
  }
  if (strategy == KeyViewStrategy::kEntropy) {
    scores = SoftmaxEntropies(descriptors, kept, options, context.pool());
  } else if (strategy == KeyViewStrategy::kCoverage) {
    scores = CoverageScores(ranking->features, kept, context);
  } else if (strategy == KeyViewStrategy::kRandom) {
    scores = RandomScores(candidates.size(), context.seed());
  }
  ranking->strategy = StrategyName(strategy);
  ranking->selection = RankViews(std::move(guarded), scores);
  if (is_film && PreferLongestShot(scene, candidates, &ranking->selection)) {
    ranking->among = "the film's longest shot";
  }
  if (options.count > 1) {
    ChooseKeyViewSet(stage_options, scene, candidates, kept, is_film, context, ranking);
  }
}

// Names of the views that the guard excluded.
void WarnOfViewsSetAside(const KeyViewRanking& ranking, ProgressObserver& progress) {
  constexpr int kMaxNamed = 8;
  std::string names;
  int count = 0;
  for (const RankedView& ranked : ranking.selection.ranking) {
    if (ranked.set_aside.empty() || ++count > kMaxNamed) continue;
    names += fmt::format(
        "{}{} ({})", names.empty() ? " " : ", ", ranking.names[ranked.index], ranked.set_aside);
  }
  if (count > kMaxNamed) names += fmt::format(" and {} more", count - kMaxNamed);
  if (count > 0) progress.OnWarning(fmt::format("key view: set aside:{}", names));
}

}  // namespace

void RunSelectKeyView(const SelectKeyViewOptions& options, StageContext& context) {
  const Scene scene = ReadScene(context);
  // Colours of held-out views must not be used.
  std::vector<int> candidates = scene.TrainingViews();
  if (scene.HasTimes()) candidates = CandidatesOfFilm(scene, options.view);
  if (options.selection.count > static_cast<int>(candidates.size())) {
    throw InvalidArgument("{} key views are requested, but the scene has only {} training views",
                          options.selection.count,
                          candidates.size());
  }
  KeyViewRanking ranking;
  ranking.strategy = StrategyName(options.selection.strategy);
  for (int view : candidates) ranking.names.push_back(scene.views[view].name);
  if (options.selection.strategy == KeyViewStrategy::kManual && options.selection.count == 1) {
    ChooseManually(options.view, scene, candidates, &ranking);
  } else {
    const bool is_film = scene.kind() == CaptureKind::kFilm;
    ChooseByScore(options, scene, candidates, is_film, context, &ranking);
  }
  for (const std::string& warning : ranking.selection.warnings) {
    context.Warn(warning);
  }
  WarnOfViewsSetAside(ranking, context.progress());
  const View& key = scene.views[candidates[ranking.selection.index]];
  // The photo as captured, in grey, for the user to colour.
  Image gray = LuminanceFromSrgb(
      ReadKeyPhoto(context.scene_folder() / key.image_file, context.MemoryBytes()));
  for (float& v : gray.data) v = static_cast<float>(GrayFromLuminance(v));
  context.WriteOutput(artifact::kKeyView, KeyViewToJson(ranking));
  context.WriteOutput(artifact::kKeyViewGray, EncodePng8(gray));
  context.WriteOutput(artifact::kKeyViewRanking,
                      KeyViewSheetJpeg(ranking, FitWithin(gray, kThumbnailSidePx)));
}

}  // namespace color3d
