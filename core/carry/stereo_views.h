// Chooses the views to match a view with, and the range of depths. Pure functions, thread-safe.
#pragma once

#include <vector>

#include "core/scene/scene.h"

namespace color3d {

struct StereoPlan {
  std::vector<int> sources;  // indices of views, best first
  double nearest = 0.0;      // camera depth, scene units
  double farthest = 0.0;
};

// Positions (scene frame) of the tracked points that each view sees, by view.
std::vector<std::vector<Eigen::Vector3d>> TrackedPoints(const Scene& scene);

// Chooses the candidates that see many points of `surface` under a parallax of some degrees, which
// is enough to measure depth and keeps pictures alike. `surface`: points that `view` sees, scene
// frame. No sources when no candidate sees a point.
StereoPlan PlanStereo(const Scene& scene,
                      int view,
                      const std::vector<Eigen::Vector3d>& surface,
                      const std::vector<int>& candidates,
                      int max_sources);

}  // namespace color3d
