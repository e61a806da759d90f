// The coloured frames of a film: their own luminance under the colours that their views got. For
// the stages of this layer only.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/scene/view_images.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/options/render_options.h"

namespace color3d {

// Lab of the size in `images` of the view with that index; the key frame keeps its own colours.
Image ColoredFrame(const View& view,
                   int index,
                   bool is_key,
                   const ViewImages& images,
                   const StageContext& context);

struct ColoredFilm {
  std::vector<int> frames;             // views, in the order in which they are shown
  std::vector<std::string> artifacts;  // names of the movie, one at least
  bool pictures = false;  // every frame as a picture of its own size, too: artifact::kFilmFrames
};

// Leaves a movie of these frames in colour, at the film's own times and size (within what movies
// take), with its sound where it came as a video file. `written`, which may be empty, is told each
// of them, in sRGB. Throws Error{kCancelled} and what Mp4Writer throws.
void WriteColoredFilm(const Scene& scene,
                      const ColoredFilm& film,
                      StageContext& context,
                      const std::function<void(int view, const Image& srgb)>& written = {});

// Of a scene that moves: what the key view's camera filmed as artifact::kFilm, of several cameras
// each of them, by its name, below artifact::kFilms. Their frames as pictures where `pictures` is
// set.
void WriteFilmsOfCameras(const Scene& scene, bool pictures, StageContext& context);

// All frames of a film as artifact::kMovie, as pictures where the options say so, and `views` (for
// the report) as artifact::kRenders.
void RenderFilm(const RenderOptions& options,
                const Scene& scene,
                const std::vector<int>& views,
                StageContext& context);

}  // namespace color3d
