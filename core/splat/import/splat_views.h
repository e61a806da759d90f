// Where to look at a splat from, when nobody says: cameras around the place where most of the
// Gaussians are, chosen from candidates by how much of the splat they see (STILL.md "A splat
// without photos"). Internal to this folder and tests.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/base/run_control.h"
#include "core/scene/camera.h"
#include "core/splat/model/gaussian_model.h"

namespace color3d {

// To within 60 degrees; -y is the custom of 3DGS files.
enum class SplatUp { kMinusY, kY, kZ };

struct SplatViewOptions {
  int views = 24;  // 2..200; fewer where fewer are any good
  SplatUp up = SplatUp::kMinusY;
  int side_px = 800;      // 64..4096, longer side of the pictures
  void Validate() const;  // throws Error{kInvalidArgument}
  bool operator==(const SplatViewOptions&) const = default;
};

// Where the Gaussians are, by medians, so that floaters and far background do not count.
struct SplatPlace {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius = 1.0;  // half of the opacity lies within it; > 0
};
SplatPlace FindSplatPlace(const GaussianModel& model);

struct SplatCamera {
  Camera camera;
  Pose cam_from_world;
  double seen = 0.0;  // share of the splat that it sees, relative to the best camera: 0..1
};

// The best first. `place.radius` of about 1 to 300 units, because the rasteriser draws nothing that
// is nearer than 0.2. Throws Error{kInvalidArgument} when the splat cannot be seen from anywhere.
std::vector<SplatCamera> ChooseSplatCameras(const GaussianModel& model,
                                            const SplatPlace& place,
                                            const SplatViewOptions& options,
                                            const RunControl& run);

// A unit vector: the normal that most flat Gaussians share within 60 degrees of `about`, or else
// that axis itself.
Eigen::Vector3d EstimateUp(const GaussianModel& model, SplatUp about);

}  // namespace color3d
