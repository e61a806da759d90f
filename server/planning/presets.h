// Presets: options in the text format of protobuf (proto/color3d/presets, compiled in), which
// submitted options override. Stateless.
#pragma once

#include <string>
#include <vector>

#include "color3d/v1/colorize_scene.pb.h"
#include "color3d/v1/job.pb.h"

namespace color3d {

struct Preset {
  std::string name;  // "fast"
  v1::ColorizeSceneSpec options;
};

// In the order of the enum.
const std::vector<Preset>& Presets();

// The options that a preset sets. PRESET_UNSPECIFIED is PRESET_FAST.
const v1::ColorizeSceneSpec& OptionsOf(v1::Preset preset);

// Merges `given` over its preset. Values in `given` win, except for enums that are "unspecified";
// lists and sources of colour are replaced as a whole. Stages without a size get that of the scene.
// Additional key views with a range of time become corrections.
v1::ColorizeSceneSpec WithPreset(const v1::ColorizeSceneSpec& given);

// Merges the options of one stage in `spec` over those in `scene`, a result of WithPreset.
void FillStage(const v1::ColorizeSceneSpec& scene, v1::JobSpec* spec);

// Films: trains the colorizer at the size of the coloured frames, up to 800 px
// (tests/bench/RESULTS.md), unless a size or the recipe of the paper is requested.
void TrainAtFrameSize(int frames_max_side_px, v1::PersonalizeSpec* spec);

}  // namespace color3d
