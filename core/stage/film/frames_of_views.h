// Views of a scene as frames of films. Stateless.
#pragma once

#include <map>
#include <vector>

#include "core/film/film_carry.h"
#include "core/scene/scene.h"
#include "core/scene/view_images.h"

namespace color3d {

// Returns `views` as frames in this order. Requires: they have times; `images` outlives the result.
FilmFrames FramesOfViews(const Scene& scene, std::vector<int> views, const ViewImages& images);

// Returns the views of each shot, in order of time. Requires: all views have times.
std::map<int, std::vector<int>> FramesByShot(const Scene& scene);

}  // namespace color3d
