// Inputs of training geometry: cameras, pictures and initial Gaussians.
#pragma once

#include <cstdint>
#include <vector>

#include "core/scene/scene.h"
#include "core/scene/view_images.h"
#include "core/splat/model/gaussian_model.h"
#include "core/splat/training/posed_camera.h"
#include "core/splat/training/training_targets.h"

namespace color3d {

struct GeometryProblem {
  std::vector<PosedCamera> training;
  std::vector<PosedCamera> held_out;
  PictureSource luminance;  // 1 channel, L in 0..100
  PictureSource colors;     // 3 channels, sRGB 0..1; when set, trained on in place of luminance
  PictureSource
      mask;  // 1 channel, 1 where a pixel counts, else 0; may be empty or return null: all
  // As `mask`: 0 where motion was detected before; may be empty or return null: unknown.
  PictureSource still;
  // 1 or 3 channels of any degree; its spherical harmonics are cut or extended to the options'
  // degree.
  GaussianModel initial;
  double extent = 1.0;  // of the scene, world units
  // All views have one pose, and z is the depth in it: depth and thickness along it cannot be
  // observed and are not trained.
  bool is_relief = false;
  // Byte budget of pictures kept in the kernels' form, and a quarter of it for masks; the others
  // are read again.
  int64_t picture_cache_bytes = int64_t{512} << 20;
};

enum class TrainingColors { kLuminance, kSrgb };

// The training views of `scene` at the working size of `images`, one Gaussian per sparse point, of
// the colour that the views see there. `images` must outlive the problem. Throws
// Error{kInvalidArgument} for a scene without points in front of any training camera.
GeometryProblem GeometryProblemOf(const Scene& scene,
                                  const ViewImages& images,
                                  TrainingColors colors = TrainingColors::kLuminance);

}  // namespace color3d
