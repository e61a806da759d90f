// Writes coloured films: each frame's own luminance with the colours of its view.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/scene/view_images.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/options/render_options.h"

namespace color3d {

// Returns the frame in Lab, of the size of `images`. The key view keeps its given colours.
Image ColoredFrame(const View& view,
                   int index,
                   bool is_key,
                   const ViewImages& images,
                   const StageContext& context);

struct ColoredFilm {
  std::vector<int> frames;             // indices of views, in order
  std::vector<std::string> artifacts;  // names of the movie, at least one
  bool pictures = false;  // also write each frame as a picture of its own size: kFilmFrames
};

// Writes a movie of the coloured frames with the film's times, its size (within the limits of
// movies) and its sound if it came as a video file. Calls `written`, unless it is empty, with each
// frame in sRGB. Throws Error{kCancelled} and what Mp4Writer throws.
void WriteColoredFilm(const Scene& scene,
                      const ColoredFilm& film,
                      StageContext& context,
                      const std::function<void(int view, const Image& srgb)>& written = {});

// For dynamic scenes: writes the film of the key view's camera as artifact::kFilm, and of several
// cameras the film of each by its name below artifact::kFilms. `pictures`: also their frames.
void WriteFilmsOfCameras(const Scene& scene, bool pictures, StageContext& context);

// Writes all frames of a film as artifact::kMovie, as pictures if the options say so, and `views`
// (for the report) as artifact::kRenders.
void RenderFilm(const RenderOptions& options,
                const Scene& scene,
                const std::vector<int>& views,
                StageContext& context);

}  // namespace color3d
