// The methods of colorize_views: each colours all views of a scene (METHOD.md "Baselines").
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "core/carry/view_color.h"
#include "core/colorizer/colorizer.h"
#include "core/scene/scene.h"
#include "core/scene/view_images.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/formats/views_checkpoint.h"
#include "core/stage/options/colorize_views_options.h"
#include "core/stage/sources/view_positions.h"

namespace color3d {

// What a method is given. The references outlive the run of the method.
struct ViewColoring {
  const Scene& scene;
  const ViewImages& images;
  const ViewPositions& positions;
  const ColorizeViewsOptions& options;
  std::shared_ptr<const Colorizer> colorizer;  // null unless ColorizeViewsOptions::NeedsColorizer
  bool are_frames = false;                     // frames of films, else photos
  ViewsCheckpoint& done;                       // receives each view's colour, if it has none yet
};

using ViewMethod = void (*)(const ViewColoring& coloring, StageContext& context);

// Throws Error{kInternal} if there is no such method.
ViewMethod MethodOf(ColorizeViewsOptions::Method method);

// The key views keep their given colours; where these are not painted, and in other views, the
// colours are those of the method.
void ColorByFusion(const ViewColoring& coloring, StageContext& context);
void ColorPersonalized(const ViewColoring& coloring, StageContext& context);
void ColorByNearestNeighbors(const ViewColoring& coloring, StageContext& context);
void ColorByDecoder(const ViewColoring& coloring, StageContext& context);
void ColorCarried(const ViewColoring& coloring, StageContext& context);
void ColorAutomatically(const ViewColoring& coloring, StageContext& context);
void ColorByFlow(const ViewColoring& coloring, StageContext& context);
void ColorGray(const ViewColoring& coloring, StageContext& context);

// Sources of colour for views: the colorizer of the scene and the embedded automatic one.
// `position` returns that of PictureFacts for a luminance. Requires: `colorizer` outlives the
// result.
ColorSources SourcesOf(const Colorizer& colorizer,
                       std::function<Image(const Image& luminance)> position = {});
// The same as the options of ColorByFusion ask for. Requires: `coloring` outlives the result.
ColorSources FusionSources(const ViewColoring& coloring,
                           std::function<Image(const Image& luminance)> position = {});

// Indices of the key views: of the carried colours or, if none were carried, the chosen one and the
// additional ones among the inputs.
std::vector<int> KeyViewsOf(const Scene& scene, const StageContext& context);
// Colours of one of these as they were given, of the size of `images`. Confidence is 0 where it is
// not painted.
CarriedColor GivenColor(const ViewColoring& coloring, int key_view, const StageContext& context);

}  // namespace color3d
