// A place of which one camera that stands still tells no depth: level ground up to the foot of an
// upright backdrop, as in a stage set ("2.5D"; Hoiem et al. 2005 call it a pop-up). An assumption,
// and a plain value.
#pragma once

#include <vector>

#include "core/scene/camera.h"

namespace color3d {

// Rows are shares of the picture's height, from its top; depths are along the optical axis, in
// units of the scene. The camera's frame is the world's.
struct Relief {
  double horizon = 0.5;         // the row that the ground would reach far away; less than `foot`
  double foot = 0.6;            // the row where the backdrop stands on the ground
  double backdrop_depth = 4.0;  // > 0

  // Depth of what the picture shows in this row.
  double Depth(double row) const;
  bool operator==(const Relief&) const = default;
};

// Whatever moves stands on the ground in front of the backdrop. `feet`: rows of what touches the
// ground, any order; without any, the backdrop's foot is a little below the middle. The picture's
// lowest row is never nearer than a quarter of the backdrop's depth.
Relief ReliefBehind(std::vector<double> feet);

// About `count` points of it, one for each square of an even grid on the picture.
std::vector<Eigen::Vector3d> PointsOn(const Relief& relief, const Camera& camera, int count);

}  // namespace color3d
