#include "server/planning/plan_scenes.h"

#include <utility>

#include "server/planning/spec_check.h"

namespace color3d {

NewGraph PlanPersonalizeScenes(const v1::JobSpec& spec,
                               const std::vector<SceneRouteInputs>& inputs) {
  CheckSpec(spec);
  const v1::PersonalizeScenesSpec& scenes = spec.personalize_scenes();
  NewGraph graph;
  graph.scene = spec.scene();
  NewJob root;
  root.kind = KindOf(spec);
  for (int i = 0; i < scenes.routes_size(); ++i) {
    v1::JobSpec own;
    own.set_scene(scenes.routes(i).scene());
    own.set_seed(spec.seed());
    own.set_skip_cache(spec.skip_cache());
    *own.mutable_personalize() = scenes.options();
    const SceneRouteInputs& route = inputs.at(static_cast<size_t>(i));
    NewJob job = std::move(PlanJob(own, route.jobs, route.facts).jobs.back());
    job.scene = own.scene();
    root.inputs.push_back(i);
    graph.jobs.push_back(std::move(job));
  }
  root.spec = spec.SerializeAsString();
  graph.jobs.push_back(std::move(root));
  return graph;
}

}  // namespace color3d
