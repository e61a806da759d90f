// Recolours ranges of time of a coloured film (FILM.md "Film").
#pragma once

#include <string>
#include <vector>

#include "core/scene/scene.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/options/correct_colors_options.h"

namespace color3d {

// Writes kCorrectedAb and kCorrectedProvenance of each frame of the ranges, and kCorrections. Other
// frames are not read. `encoder`: as in RunColorizeViews.
void RecolorRanges(const std::vector<RangeKeyView>& keys,
                   const Scene& scene,
                   const std::string& encoder,
                   StageContext& context);

}  // namespace color3d
