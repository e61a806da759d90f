#include "core/stage/report/next_key_view.h"

#include <algorithm>
#include <numeric>

#include "core/image/codec.h"
#include "core/keyview/expected_error.h"
#include "core/stage/formats/artifacts.h"

namespace color3d {

std::vector<float> ExpectedErrorsOf(const Image& shares, const SampleGrid& grid) {
  std::vector<float> errors;
  for (int s = 0; s < grid.samples(); ++s) {
    const int x = std::min(static_cast<int>(grid.X(s) * shares.width), shares.width - 1);
    const int y = std::min(static_cast<int>(grid.Y(s) * shares.height), shares.height - 1);
    errors.push_back(static_cast<float>(kErrorGuessed * shares.At(0, y, x) +
                                        kErrorSeen * shares.At(1, y, x) +
                                        kErrorInferred * shares.At(2, y, x)));
  }
  return errors;
}

std::optional<NextKeyViewFacts> AdviseNextKeyView(const Scene& scene,
                                                  const std::vector<std::string>& key_views,
                                                  StageContext& context) {
  constexpr size_t kMaxViews = 500;  // a minute of rendering; who has more knows what to add
  if (!context.HasInput(artifact::kModel) || scene.views.size() > kMaxViews) return std::nullopt;
  const SampleGrid grid = GridFor(static_cast<int>(scene.views.size()));
  std::vector<int> all(scene.views.size()), candidates;
  std::iota(all.begin(), all.end(), 0);
  std::vector<std::vector<float>> errors;
  for (const int view : all) {
    const std::string name = ViewArtifact(artifact::kProvenance, scene.views[view], ".png");
    if (!context.HasInput(name)) return std::nullopt;
    const Image shares = DecodeImage(context.ReadInput(name), name);
    if (shares.channels != 3) throw InvalidArgument("{} is grey; it must be RGB", name);
    const bool is_key =
        std::find(key_views.begin(), key_views.end(), scene.views[view].name) != key_views.end();
    // The user's own colours are right.
    errors.push_back(is_key ? std::vector<float>(grid.samples(), 0.0f)
                            : ExpectedErrorsOf(shares, grid));
    if (!is_key && !scene.views[view].held_out) candidates.push_back(view);
  }
  const SeenSamples seen = SeenByGeometry(scene,
                                          all,
                                          ParseGaussians(context.ReadInput(artifact::kModel)),
                                          grid,
                                          context.pool(),
                                          context.cancel());
  const auto next = NextKeyView(seen, errors, candidates);
  if (!next) return std::nullopt;
  return NextKeyViewFacts{scene.views[next->view].name, next->error_now, next->error_with};
}

}  // namespace color3d
