#include "core/stage/report/next_key_view.h"

#include <algorithm>
#include <filesystem>
#include <map>

#include "core/keyview/collect_features.h"
#include "core/keyview/expected_error.h"
#include "core/stage/film/film_keys.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/carry_facts.h"
#include "core/stage/sources/seen_samples.h"

namespace color3d {

std::optional<NextKeyViewFacts> AdviseNextKeyView(const Scene& scene,
                                                  const std::vector<std::string>& key_views,
                                                  StageContext& context) {
  const bool are_pictures = scene.are_pictures;
  if (!scene.capture().is_reconstructed && !are_pictures) {
    std::vector<int> of_film;
    for (const std::string& name : key_views) of_film.push_back(scene.FindView(name));
    const std::map<std::string, double> covered = ReadCarryFacts(context).view_coverage;
    std::vector<double> coverage;
    for (const View& view : scene.views) {
      const auto found = covered.find(view.name);
      coverage.push_back(found == covered.end() ? 0.0 : found->second);
    }
    const auto next = AdviseNextFilmKey(scene, of_film, coverage);
    if (!next) return std::nullopt;
    return NextKeyViewFacts{scene.views[next->view].name, next->error_now, next->error_with};
  }
  constexpr size_t kMaxViews = 500;  // about a minute of rendering
  const std::vector<int> training = scene.TrainingViews();
  if (!(context.HasInput(artifact::kModel) || are_pictures) || training.size() > kMaxViews) {
    return std::nullopt;
  }
  std::vector<int> keys;
  std::vector<std::filesystem::path> photos;
  for (size_t k = 0; k < training.size(); ++k) {
    const View& view = scene.views[training[k]];
    photos.push_back(context.scene_folder() / view.image_file);
    if (std::ranges::find(key_views, view.name) != key_views.end()) {
      keys.push_back(static_cast<int>(k));
    }
  }
  const auto encoder = context.LoadEncoder("");
  const auto features =
      CollectViewFeatures(*encoder, *encoder, photos, FeatureCache(context), context.control());
  const NearestDistances distances =
      FindNearestDistances(features, std::vector<bool>(training.size(), true), context.control());
  const int count = static_cast<int>(training.size());
  const SeenSamples seen = are_pictures
                               ? SeenSamples(count, 0)
                               : SeenByGeometry(scene,
                                                training,
                                                ParseGaussians(context.ReadInput(artifact::kModel)),
                                                GridFor(count),
                                                context.pool(),
                                                context.cancel());
  const auto next = NextKeyView(seen, distances, keys);
  if (!next) return std::nullopt;
  return NextKeyViewFacts{
      scene.views[training[next->view]].name, next->error_now, next->error_with};
}

}  // namespace color3d
