// The graph of a personalize_scenes job: one personalize job for each scene under one parent. Uses
// no store and no clock.
#pragma once

#include <vector>

#include "server/planning/planner.h"

namespace color3d {

// The colorize_key_view job of a route and its inputs.
struct SceneRouteInputs {
  std::vector<JobRecord> jobs;
  SceneFacts facts;
};

// `inputs`: one for each of spec.personalize_scenes.routes. Throws what PlanJob throws.
NewGraph PlanPersonalizeScenes(const v1::JobSpec& spec,
                               const std::vector<SceneRouteInputs>& inputs);

}  // namespace color3d
