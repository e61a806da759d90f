// Initial velocity of moving objects from optical flow to a camera's previous and next frames.
// Internal to the splat module. Deterministic for every thread count.
#pragma once

#include <vector>

#include "core/base/parallel.h"
#include "core/splat/movers/motion_survey.h"

namespace color3d {

// A moving pixel of a surveyed view, as a point in space.
struct MoverSeed {
  int x = 0;
  int y = 0;
  double depth = 0.0;  // world units
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // world units per unit of GaussianMotion's t
};

// Sets the velocity of each view's seeds to the mean of those to the previous and the next frame,
// as far as optical flow leads to a moving pixel there. A point keeps its depth if no seed is near
// its destination. `step`: distance of neighbouring seeds, px.
void FindVelocities(const std::vector<SurveyedView>& views,
                    const std::vector<float>& unit_time,
                    int step,
                    ThreadPool& pool,
                    std::vector<std::vector<MoverSeed>>& seeds);

}  // namespace color3d
