// The page to look at the scene in a browser. For the report stage only.
#pragma once

#include "core/scene/scene.h"
#include "core/stage/stage.h"

namespace color3d {

// Leaves artifact::kViewPage, from the exported scene and the model; it opens at the key view.
// False, and nothing is left, without one of these or without a viewer in this build, which is told
// as a warning. Throws Error{kCancelled} and what reading the photos throws.
bool WriteViewPage(const Scene& scene, int key_view, StageContext& context);

}  // namespace color3d
