// The page to look at the scene in a browser. For the export stage only.
#pragma once

#include <string>

#include "core/scene/scene.h"
#include "core/splat/model/gaussian_model.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

struct ExportedFile {
  std::string name;  // artifact::kSog or kPly; empty: none was exported
  std::string bytes;
};

// Leaves artifact::kViewPage with that file of the model in it; it opens at the key view. `moves`:
// the model is one of the key view's moment, so that only the photos of that moment are there.
// False, and nothing is left, without a file or without a viewer in this build, which is told as a
// warning. Throws Error{kCancelled} and what reading the photos throws.
bool WriteViewPage(const Scene& scene,
                   int key_view,
                   const GaussianModel& model,
                   bool moves,
                   const ExportedFile& file,
                   StageContext& context);

}  // namespace color3d
