// Writes photos that are no views of a 3D scene in colour. Stateless.
#pragma once

#include <vector>

#include "core/scene/scene.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/options/render_options.h"

namespace color3d {

// Writes every photo with its own luminance and size as artifact::kColoredPhotos, and `views`, at
// most options.max_side_px, as artifact::kRenders for the report.
void WriteColoredPhotos(const RenderOptions& options,
                        const Scene& scene,
                        const std::vector<int>& views,
                        StageContext& context);

// Writes the unplaced photos of a scene, as far as colours are among the inputs, in the same way.
void WriteUnplacedPhotos(const Scene& scene, StageContext& context);

}  // namespace color3d
