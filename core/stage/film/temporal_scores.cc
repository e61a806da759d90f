#include "core/stage/film/temporal_scores.h"

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/metrics/scene_consistency.h"
#include "core/metrics/temporal_consistency.h"
#include "core/stage/film/film_writer.h"
#include "core/stage/film/frames_of_views.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/sources/render_view.h"

namespace color3d {
namespace {

using nlohmann::ordered_json;

constexpr int64_t kScoredFramesCacheBytes = int64_t{16} << 20;  // each frame is read twice in a row

ordered_json JsonOf(const TemporalConsistency& consistency) {
  ordered_json json{{"pairs", consistency.pairs}};
  for (const auto& [name, value] : consistency.Figures()) json[name] = value;
  return json;
}

}  // namespace

ordered_json TemporalScores(const Scene& scene,
                            const std::optional<GaussianModel>& model,
                            const std::optional<GaussianModel>& bound,
                            const std::map<int, std::filesystem::path>& truth,
                            StageContext& context) {
  ordered_json json = ordered_json::object();
  if (!scene.HasTimes()) return json;
  const ViewImages images(
      scene, context.scene_folder(), kConsistencySidePx, kScoredFramesCacheBytes);
  const int key = context.HasInput(artifact::kKeyView) ? ReadKeyView(context, scene) : -1;
  TemporalSource source;
  for (auto& [shot, frames] : FramesByShot(scene)) source.shots.push_back(std::move(frames));
  source.luminance = [&](int view) { return *images.Luminance(view); };
  std::vector<std::string> names = {"colored_views"};
  source.colorings.emplace_back([&](int view) {
    return ColoredFrame(scene.views[view], view, view == key, images, context);
  });
  const auto add_pictures_of = [&](const GaussianModel& of, const char* name) {
    names.emplace_back(name);
    source.colorings.emplace_back([&](int view) {
      ThreadPool one(1);
      const View& seen = scene.views[view];
      const Camera camera = images.WorkingCamera(view);
      return RenderView(of, seen, camera, one).lab;
    });
  };
  if (model) add_pictures_of(*model, "rendered");
  if (bound) add_pictures_of(*bound, "bound");
  if (truth.size() == scene.views.size()) {
    names.emplace_back("truth");
    source.colorings.emplace_back(
        [&](int view) { return LabFromSrgb(images.UndistortFile(view, truth.at(view))); });
  }
  const std::vector<TemporalConsistency> figures =
      MeasureTemporalConsistency(source, context.pool(), context.cancel());
  if (figures.front().pairs == 0) return json;
  for (size_t i = 0; i < names.size(); ++i) json[names[i]] = JsonOf(figures[i]);
  return json;
}

}  // namespace color3d
