#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/color/lab.h"
#include "core/encoder/encoder.h"
#include "core/image/codec.h"
#include "core/keyview/coverage.h"
#include "core/scene/view_images.h"
#include "core/stage/artifacts.h"
#include "core/stage/stages.h"

namespace color3d {
namespace {

constexpr int kFeatureSidePx = 384;

const char* StrategyName(KeyViewStrategy strategy) {
  switch (strategy) {
    case KeyViewStrategy::kEntropy:
      return "entropy";
    case KeyViewStrategy::kCoverage:
      return "coverage";
    case KeyViewStrategy::kManual:
      return "manual";
  }
  return "coverage";
}

// Candidates are the training views: a held-out view must never lend its colour.
KeyViewSelection Select(const SelectKeyViewOptions& options,
                        const Scene& scene,
                        const std::vector<int>& candidates,
                        StageContext& context) {
  KeyViewSelection selection;
  if (options.selection.strategy == KeyViewStrategy::kManual) {
    const int view = scene.FindView(options.view);
    const auto found = std::find(candidates.begin(), candidates.end(), view);
    if (found == candidates.end()) {
      throw InvalidArgument("the view " + scene.views[view].name +
                            " is held out for evaluation and cannot be the key view");
    }
    selection.index = static_cast<int>(found - candidates.begin());
    selection.ranking = {{selection.index, 0.0, 0.0, false}};
    return selection;
  }
  const ViewImages images(scene, context.scene_folder(), kFeatureSidePx, 0);
  const auto encoder = Encoder::Embedded();
  const bool coverage = options.selection.strategy == KeyViewStrategy::kCoverage;
  std::vector<std::vector<double>> descriptors;
  std::vector<Image> deep;
  for (size_t i = 0; i < candidates.size(); ++i) {
    context.cancel().ThrowIfCancelled();
    const auto luminance = images.Luminance(candidates[i]);
    descriptors.push_back(encoder->Describe(*luminance));
    if (coverage) deep.push_back(encoder->DeepFeatures(*luminance));
    context.progress().OnProgress(
        static_cast<int64_t>(i) + 1, static_cast<int64_t>(candidates.size()), "features");
  }
  if (!coverage) return SelectKeyViewByEntropy(descriptors, options.selection);
  const auto distances = FeatureDistances(deep, context.progress(), context.cancel());
  return SelectKeyViewByCoverage(distances, descriptors, options.selection);
}

// The views that the guard set aside, by the names that the user knows.
void WarnOfViewsSetAside(const KeyViewSelection& selection,
                         const Scene& scene,
                         const std::vector<int>& candidates,
                         ProgressObserver& progress) {
  std::string names;
  for (const RankedView& ranked : selection.ranking) {
    if (ranked.set_aside) names += " " + scene.views[candidates[ranked.index]].name;
  }
  if (!names.empty()) progress.OnWarning("key view: set aside:" + names);
}

}  // namespace

void RunSelectKeyView(const SelectKeyViewOptions& options, StageContext& context) {
  const Scene scene = ReadScene(context);
  const std::vector<int> candidates = scene.TrainingViews();
  const KeyViewSelection selection = Select(options, scene, candidates, context);
  for (const std::string& warning : selection.warnings) context.progress().OnWarning(warning);
  WarnOfViewsSetAside(selection, scene, candidates, context.progress());

  const View& key = scene.views[candidates[selection.index]];
  nlohmann::ordered_json result{{"view", key.name},
                                {"strategy", StrategyName(options.selection.strategy)},
                                {"margin", selection.margin}};
  for (const RankedView& ranked : selection.ranking) {
    result["ranking"].push_back({{"view", scene.views[candidates[ranked.index]].name},
                                 {"score", ranked.score},
                                 {"mean_similarity", ranked.mean_similarity},
                                 {"set_aside", ranked.set_aside}});
  }
  // The photo as captured, in grey: what the user colours.
  const Image luminance = LuminanceFromSrgb(ReadImage(context.scene_folder() / key.image_file));
  Image gray = luminance;
  for (float& v : gray.data) v = static_cast<float>(GrayFromLuminance(v));
  context.WriteOutput(artifact::kKeyView, result.dump(1) + "\n");
  context.WriteOutput(artifact::kKeyViewGray, EncodePng8(gray));
}

}  // namespace color3d
