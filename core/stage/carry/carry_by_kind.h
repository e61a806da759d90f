// How the colours of key views are carried into all other views: one function for each kind of
// scene, of which carry_color.cc chooses one. Each writes kCarried and kCarryFacts and goes on
// where a killed worker has stopped.
#pragma once

#include <algorithm>
#include <vector>

#include "core/scene/scene.h"
#include "core/splat/model/gaussian_model.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/options/carry_color_options.h"

namespace color3d {

struct CarryInputs {
  const CarryColorOptions& options;
  const Scene& scene;
  std::vector<int> key_views;     // indices, in order of importance
  const GaussianModel& geometry;  // empty for films

  bool IsKeyView(int view) const { return std::ranges::find(key_views, view) != key_views.end(); }
};

// Static scenes: by depth and visibility.
void CarryStatic(const CarryInputs& inputs, StageContext& context);

// Films without geometry: by optical flow within a shot, and by local features into shots without a
// key view.
void CarryFilm(const CarryInputs& inputs, StageContext& context);

// Photos whose cameras are not known: to the planes that local features find in other photos.
void CarryPictures(const CarryInputs& inputs, StageContext& context);

// Dynamic scenes: by optical flow along the cameras that took a key view, from their frames of the
// same time by depth and visibility into those of other cameras.
void CarryDynamic(const CarryInputs& inputs, StageContext& context);

}  // namespace color3d
