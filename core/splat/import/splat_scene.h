// Builds a scene without photos from a splat: views chosen around it, and its Gaussians in grey,
// which need no training (STILL.md "A splat without photos").
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/run_control.h"
#include "core/scene/scene.h"
#include "core/splat/import/splat_file.h"
#include "core/splat/import/splat_views.h"
#include "core/splat/model/gaussian_model.h"

namespace color3d {

struct SplatScene {
  // Cameras, points on the Gaussians, and the transform between the scene and the file. Views are
  // named view_01.png, ...; these files do not exist yet: `image_file` is the name.
  Scene scene;
  GaussianModel geometry;             // luminance only, in the scene's frame
  int64_t gaussians = 0;              // in the file
  int64_t dropped = 0;                // dropped because they cannot be drawn
  bool had_color = false;             // colour was removed
  std::vector<std::string> warnings;  // for the report; not sent to the observer
};

// Maximum memory of any stage per Gaussian of a splat of this degree, bytes: that of the export,
// which fits colours to whole pictures.
int64_t WorkBytesPerGaussian(int sh_degree);

// `bytes`: a file that ReadSplat reads. Throws Error as ReadSplat, GrayModelOf and
// ChooseSplatCameras do, and Error{kResourceExhausted} with the numbers if the work needs more than
// `memory_bytes`. Keeps no checkpoints.
SplatScene ImportSplat(std::string_view bytes,
                       const std::string& name,
                       const SplatViewOptions& options,
                       int64_t memory_bytes,
                       const RunControl& run);

}  // namespace color3d
