#include "core/base/range_check.h"
#include "core/catalogue/limits.h"
#include "core/stage/carry/carry_by_kind.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/key_views.h"
#include "core/stage/run_stages.h"

namespace color3d {

void CarryColorOptions::Validate() const {
  CheckMaxSide(max_side_px);
  const RangeCheck check("carry option");
  check("depth_side_px", depth_side_px, 64, 2048);
  check("depth_sources", depth_sources, 0, kMaxSweepSources);
  check("min_agreement", min_agreement, 0.0, 1.0);
  if (additional_key_views.size() > size_t{kMaxAdditionalKeyViews}) {
    throw InvalidArgument("{} additional key views were given; at most {} are taken",
                          additional_key_views.size(),
                          kMaxAdditionalKeyViews);
  }
  sweep.Validate();
  carry.Validate();
  film.Validate();
}

void RunCarryColor(const CarryColorOptions& options, StageContext& context) {
  options.Validate();
  Scene scene = ReadScene(context);
  const std::vector<int> key_views = ReadKeyViews(context, scene, options.additional_key_views);
  if (scene.are_pictures) {
    return CarryPictures({options, scene, key_views, GaussianModel()}, context);
  }
  if (!ColoredAs(context, scene).is_reconstructed) {
    return CarryFilm({options, scene, key_views, GaussianModel()}, context);
  }
  const GaussianModel geometry = ParseGaussians(context.ReadInput(artifact::kGeometry));
  if (geometry.IsDynamic()) {
    return CarryDynamic({options, scene, key_views, geometry}, context);
  }
  // Frames of a static scene are photos of it.
  for (View& view : scene.views) view.moment.reset();
  CarryStatic({options, scene, key_views, geometry}, context);
}

}  // namespace color3d
