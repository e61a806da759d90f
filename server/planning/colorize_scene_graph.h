// The graph of a colorize_scene job: every stage of the pipeline, with what the scene's options say
// of each.
#pragma once

#include "color3d/v1/job.pb.h"
#include "server/planning/graph_builder.h"
#include "server/planning/scene_facts.h"

namespace color3d {

// Of generate_augmentations, where somebody asks for it without a number.
inline constexpr int kDefaultSamples = 8;
// What unset samples mean: who asks for pictures of their own wants those alone.
inline int SamplesOf(const v1::GenerateAugmentationsSpec& spec) {
  if (spec.has_samples()) return spec.samples();
  return spec.files() ? 0 : kDefaultSamples;
}

// Adds all jobs to the builder, which fills in the options of each stage from `scene`: what was
// submitted, over its preset, with the options of the import that is given, if one is. Throws Error
// for inputs that the submitted options contradict, or that lack a job which they read.
void BuildColorizeSceneGraph(const v1::JobSpec& submitted,
                             const v1::ColorizeSceneSpec& scene,
                             const SceneFacts& facts,
                             GraphBuilder* builder);

}  // namespace color3d
