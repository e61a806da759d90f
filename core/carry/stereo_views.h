// Which views to match a view with, and between which depths. Pure functions, thread-safe.
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

// `surface`: points (scene frame) that `view` sees. Sources are those of `candidates` that see many
// of them under angles of some degrees: enough parallax to measure depth, not so much that pictures
// differ. No sources when no candidate sees any.
StereoPlan PlanStereo(const Scene& scene,
                      int view,
                      const std::vector<Eigen::Vector3d>& surface,
                      const std::vector<int>& candidates,
                      int max_sources);

}  // namespace color3d
