// Colours of all frames of a film, or of the cameras of a scene that moves. For the stages of this
// layer only.
#pragma once

#include <functional>

#include "core/carry/view_color.h"
#include "core/scene/view_images.h"
#include "core/stage/stage.h"

namespace color3d {

struct FrameColoring {
  // The colour of one view by itself, which takes longest. Thread-safe.
  std::function<FusedColor(int view)> alone;
  RelativeChroma relative_chroma;
  // Takes each view's colour once, in any order. Thread-safe.
  std::function<void(int view, const FusedColor& color)> deliver;
};

// Anchors are coloured by themselves (core/film/anchor_frames.h); a frame between them has what was
// carried into it, as they have, and where that leaves it open the colours of the nearest anchor,
// followed by motion. Frames of which motion does not follow enough are coloured by themselves,
// too. Memory does not grow with the number of frames.
void ColorFrames(const Scene& scene,
                 const ViewImages& images,
                 const FrameColoring& coloring,
                 StageContext& context);

}  // namespace color3d
