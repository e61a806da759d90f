// How fast what moves is at first: by optical flow to a camera's frames before and after. Internal
// to the splat module. Deterministic whatever the thread count.
#pragma once

#include <vector>

#include "core/base/parallel.h"
#include "core/splat/geometry/motion_survey.h"

namespace color3d {

// A pixel of a surveyed view that moves, as a place in space.
struct MoverSeed {
  int x = 0;
  int y = 0;
  double depth = 0.0;  // world units
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // world units per unit of GaussianMotion's t
};

// Sets the velocity of each view's seeds: the mean of those to the frame before and to the one
// after, of those of the two that flow finds among what moves there. A place keeps its depth where
// no seed is near the one that it comes to. `step`: distance of neighbouring seeds, px.
void FindVelocities(const std::vector<SurveyedView>& views,
                    const std::vector<float>& unit_time,
                    int step,
                    ThreadPool& pool,
                    std::vector<std::vector<MoverSeed>>& seeds);

}  // namespace color3d
