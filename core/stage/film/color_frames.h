// Colours of all frames of a film, or of the cameras of a scene that moves. For the stages of this
// layer only.
#pragma once

#include <functional>
#include <vector>

#include "core/carry/view_color.h"
#include "core/scene/view_images.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

struct FrameColoring {
  // What a view's colour comes from beside what was carried into it. Thread-safe.
  std::function<ColorSources(int view)> sources;
  // Takes each view's colour once, in any order, but those that were done. Thread-safe.
  std::function<void(int view, const FusedColor& color)> deliver;
  // Views that an interrupted run has delivered. Thread-safe.
  std::function<bool(int view)> was_done;
  // Views whose colours are somebody's own and stay as they are, in the order in which they were
  // given.
  std::vector<int> key_views;
};

// Anchors are coloured by their sources (core/film/anchor_frames.h). A frame between them has what
// was carried into it, as they have; where that leaves it open, the colours of the anchors before
// and behind it, followed by motion; and where motion does not tell, its own sources are asked. In
// the end all are steadied along motion (core/film/steady_colors.h), each with those that it shares
// its nearest key frame with. Memory does not grow with the number of frames; what comes of an
// interrupted run is the same to the bit.
void ColorFrames(const Scene& scene,
                 const ViewImages& images,
                 const FrameColoring& coloring,
                 StageContext& context);

}  // namespace color3d
