// Colours all frames of a film, or of the cameras of a dynamic scene.
#pragma once

#include <functional>
#include <vector>

#include "core/carry/view_color.h"
#include "core/scene/view_images.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

struct FrameColoring {
  // Sources of a view's colour beside the carried colours. Thread-safe.
  std::function<ColorSources(int view)> sources;
  // Called once with the colour of each view that was not done, in any order. Thread-safe.
  std::function<void(int view, const FusedColor& color)> deliver;
  // Returns true if an interrupted run has delivered the view. Thread-safe.
  std::function<bool(int view)> was_done;
  // Views that keep their given colours, in the order in which they were given.
  std::vector<int> key_views;
};

// Colours anchors (core/film/anchor_frames.h) from what was carried into them and their sources. A
// frame between anchors has its carried colours; where these are open, the colours of the anchors
// before and after it, propagated by optical flow; and where these are open, too, colours of its
// own sources. All are then averaged along flow (core/film/steady_colors.h) among frames with the
// same nearest key frame. Memory does not grow with the number of frames. An interrupted run gives
// the same bits.
void ColorFrames(const Scene& scene,
                 const ViewImages& images,
                 const FrameColoring& coloring,
                 StageContext& context);

}  // namespace color3d
