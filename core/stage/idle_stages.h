// Stages that have nothing to do for the kind of a scene where the plan could not know it: films
// whose poses import has looked for in vain (WhyNothingToDo in core/catalogue/captures.h).
#pragma once

#include <string_view>

#include "core/stage/context/stage_context.h"

namespace color3d {

// Returns the reason why a stage has nothing to do for the scene among the inputs, after writing
// the empty artifacts that later stages read. Returns "" if the stage has to run.
std::string_view SkipIdleStage(std::string_view stage, StageContext& context);

}  // namespace color3d
