// Parts of a coloured film in other colours (METHOD.md "Film"). For the stages of this layer only.
#pragma once

#include <string>
#include <vector>

#include "core/scene/scene.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/options/correct_colors_options.h"

namespace color3d {

// Colours the frames of the ranges anew: kCorrectedAb and kCorrectedProvenance of each, and
// kCorrections. Other frames are not read. `encoder`: as RunColorizeViews'.
void RecolorRanges(const std::vector<RangeKeyView>& keys,
                   const Scene& scene,
                   const std::string& encoder,
                   StageContext& context);

}  // namespace color3d
