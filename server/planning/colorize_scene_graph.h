// The graph of a colorize_scene job: every stage of the pipeline, with its options. Pure functions.
#pragma once

#include "color3d/v1/job.pb.h"
#include "server/planning/graph_builder.h"
#include "server/planning/scene_facts.h"

namespace color3d {

// generate_augmentations.samples if the stage is requested without a number.
inline constexpr int kDefaultSamples = 8;
// Number of samples. Unset: none beside pictures of the user, else the default.
inline int SamplesOf(const v1::GenerateAugmentationsSpec& spec) {
  if (spec.has_samples()) return spec.samples();
  return spec.files() ? 0 : kDefaultSamples;
}

// Adds all jobs to the builder. `scene`: the submitted options over their preset, with the options
// of the import if one is among the inputs. Throws Error for inputs that contradict the submitted
// options or whose own inputs are missing.
void BuildColorizeSceneGraph(const v1::JobSpec& submitted,
                             const v1::ColorizeSceneSpec& scene,
                             const SceneFacts& facts,
                             GraphBuilder* builder);

}  // namespace color3d
