// Inputs of training geometry: cameras, pictures and initial Gaussians.
#pragma once

#include <cstdint>
#include <vector>

#include "core/scene/scene.h"
#include "core/scene/view_images.h"
#include "core/splat/geometry/geometry_options.h"
#include "core/splat/model/color_layout.h"
#include "core/splat/model/gaussian_model.h"
#include "core/splat/training/posed_camera.h"
#include "core/splat/training/training_targets.h"

namespace color3d {

struct GeometryState;

struct GeometryProblem {
  std::vector<PosedCamera> training;
  std::vector<PosedCamera> held_out;
  PictureSource luminance;  // 1 channel, L in 0..100
  // 3 channels of `color_space`; when set, trained on in place of luminance: sRGB 0..1, or L', a',
  // b'.
  PictureSource colors;
  ColorSpace color_space = ColorSpace::kSrgb;
  int chroma_sh_degree = 0;  // of a' and b', at most the options' degree; kLab only
  // 1 channel, 1 where a pixel counts, else 0; may be empty or return null: all pixels count.
  PictureSource mask;
  // As `mask`: 0 where motion was detected before; may be empty or return null: unknown.
  PictureSource still;
  // 1 or 3 channels of any degree; its spherical harmonics are cut or extended to the options'
  // degree.
  GaussianModel initial;
  // State at the end of a warm-up on the same views (warm_up.h), which is continued in place of
  // starting from `initial`; must outlive the training. Null: starts from `initial`.
  const GeometryState* start = nullptr;
  double extent = 1.0;  // of the scene, world units
  // All views have one pose, and z is the depth in it: depth and thickness along it cannot be
  // observed and are not trained.
  bool is_relief = false;
  // Byte budget of pictures kept in the kernels' form, and a quarter of it for masks; the others
  // are read again.
  int64_t picture_cache_bytes = int64_t{512} << 20;
};

// Layout of the trained colours. Throws Error{kInvalidArgument} if a and b have a higher degree
// than luminance, or no warm-up to start from.
ColorLayout TrainedLayout(const GeometryProblem& problem, const GeometryOptions& options);

enum class TrainingColors { kLuminance, kSrgb };

// The views of `scene` with their luminance at the working size of `images`, without initial
// Gaussians. `images` must outlive the problem.
GeometryProblem GeometryProblemWithoutStart(const Scene& scene, const ViewImages& images);

// The same, with one Gaussian per sparse point, of the colour that the training views see there:
// luminance, or `srgb` (3 channels, 0..1), which is then trained on. Throws
// Error{kInvalidArgument} for a scene without points in front of any training camera.
GeometryProblem GeometryProblemOf(const Scene& scene,
                                  const ViewImages& images,
                                  PictureSource srgb = {});
// The same, on luminance or on the colours of the photos.
GeometryProblem GeometryProblemOf(const Scene& scene,
                                  const ViewImages& images,
                                  TrainingColors colors);

}  // namespace color3d
