// Assumed depth (2.5D) for scenes of one static camera: level ground up to the foot of an upright
// backdrop, as on a stage (a "pop-up", Hoiem et al. 2005). Plain value.
#pragma once

#include <vector>

#include "core/scene/camera.h"

namespace color3d {

// Rows are fractions of the picture height from the top; depths are along the optical axis, in
// scene units. The camera frame is the world frame.
struct Relief {
  double horizon = 0.5;         // row of the ground at infinity; less than `foot`
  double foot = 0.6;            // row where the backdrop meets the ground
  double backdrop_depth = 4.0;  // > 0

  // Depth of the surface visible in this row.
  double Depth(double row) const;
  bool operator==(const Relief&) const = default;
};

// Places moving objects on the ground in front of the backdrop. `feet`: rows where they touch the
// ground, any order; if empty, the backdrop's foot is slightly below the middle. The lowest row of
// the picture is never nearer than a quarter of the backdrop's depth.
Relief FitRelief(std::vector<double> feet);

// Returns about `count` points on it, one for each cell of a regular grid on the picture.
std::vector<Eigen::Vector3d> ReliefPoints(const Relief& relief, const Camera& camera, int count);

}  // namespace color3d
