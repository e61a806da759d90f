// Measures the error of RGB blending in viewers against our Lab renders, and refines the RGB
// harmonics to reduce it (EXPORT.md "Export").
#pragma once

#include <vector>

#include "core/base/run_control.h"
#include "core/scene/camera.h"
#include "core/splat/export/rgb_harmonics.h"
#include "core/splat/model/gaussian_model.h"

namespace color3d {

struct RgbView {
  Camera camera;
  Pose cam_from_world;
  bool fitted = true;   // false: measured only
  double time_s = 0.0;  // used for models that move only
};

// PSNR (peak 1, at most 99 dB) over all pixels and channels of the sRGB picture that the reference
// 3DGS renderer draws (max(0, SH + 0.5) blended over black, clamped to 0..1) against our Lab render
// converted to sRGB.
struct RgbLoss {
  double mean_psnr_db = 0.0;  // over the views
  double worst_psnr_db = 0.0;
  int worst_view = -1;  // index of the view
};

struct RgbRefineOptions {
  int epochs = 4;               // over the fitted views, 0..1000
  double learning_rate = 4e-2;  // of degree 0 at the start, 1e-6..1; falls to a tenth
  uint64_t seed = 1;
  void Validate() const;  // throws Error{kInvalidArgument}
};

struct RgbRefinement {
  RgbHarmonics harmonics;  // unchanged if refinement gained nothing
  RgbLoss before;
  RgbLoss after;
};

// Adam on the coefficients with geometry fixed; squared error against our renders of the fitted
// views. Renders every view once and keeps the pictures (12 bytes a pixel). Saves no checkpoints.
// Throws Error{kInvalidArgument} without views, Error{kCancelled}.
RgbRefinement RefineRgbHarmonics(const GaussianModel& model,
                                 RgbHarmonics start,
                                 const std::vector<RgbView>& views,
                                 const RgbRefineOptions& options,
                                 const RunControl& run);

}  // namespace color3d
