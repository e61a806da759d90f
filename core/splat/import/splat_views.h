// Default views of a splat: cameras around the region that contains most of the Gaussians, selected
// from candidates by the share of the splat that they see (STILL.md "A splat without photos").
// Internal to this folder and tests.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/base/run_control.h"
#include "core/scene/camera.h"
#include "core/splat/model/gaussian_model.h"

namespace color3d {

// Accurate within 60 degrees; -y is the convention of 3DGS files.
enum class SplatUp { kMinusY, kY, kZ };

struct SplatViewOptions {
  int views = 24;  // 2..200; fewer if fewer are useful
  SplatUp up = SplatUp::kMinusY;
  int side_px = 800;      // 64..4096, longer side of the pictures
  void Validate() const;  // throws Error{kInvalidArgument}
  bool operator==(const SplatViewOptions&) const = default;
};

// Centre and size of the Gaussians, by medians, so that floaters and far background do not count.
struct SplatExtent {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius = 1.0;  // contains half of the opacity; > 0
};
SplatExtent FindSplatExtent(const GaussianModel& model);

struct SplatCamera {
  Camera camera;
  Pose cam_from_world;
  double seen = 0.0;  // share of the splat that it sees, relative to the best camera: 0..1
};

// Best first. `extent.radius` is about 1 to 300 units, because the rasterizer draws nothing nearer
// than 0.2. Throws Error{kInvalidArgument} if the splat is visible from nowhere.
std::vector<SplatCamera> ChooseSplatCameras(const GaussianModel& model,
                                            const SplatExtent& extent,
                                            const SplatViewOptions& options,
                                            const RunControl& run);

// Unit vector: the most common normal of flat Gaussians within 60 degrees of `about`, or `about`
// itself.
Eigen::Vector3d EstimateUp(const GaussianModel& model, SplatUp about);

}  // namespace color3d
