// The coloured frames of a film: their own luminance under the colours that their views got. For
// the stages of this layer only.
#pragma once

#include <functional>
#include <vector>

#include "core/scene/view_images.h"
#include "core/stage/stage.h"
#include "core/stage/stages.h"

namespace color3d {

// Lab of the size in `images` of the view with that index; the key frame keeps its own colours.
Image ColoredFrame(const View& view,
                   int index,
                   bool is_key,
                   const ViewImages& images,
                   const StageContext& context);

// Leaves a movie: these frames, in order of time, in colour, at the film's own times and size, with
// its sound where it came as a video file. `written`, which may be empty, is told each of them, in
// sRGB. Throws Error{kCancelled} and what Mp4Writer throws.
void WriteColoredFilm(const Scene& scene,
                      const std::vector<int>& frames,
                      const char* artifact,
                      StageContext& context,
                      const std::function<void(int view, const Image& srgb)>& written = {});

// All frames of a film as artifact::kMovie, and `views` (for the report) as artifact::kRenders.
void RenderFilm(const RenderOptions& options,
                const Scene& scene,
                const std::vector<int>& views,
                StageContext& context);

}  // namespace color3d
