// What a preset means: options in protobuf's text form (proto/color3d/presets, compiled in), which
// lie under what the user gives.
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

// In the order of their numbers.
const std::vector<Preset>& Presets();

// The options that a preset sets. PRESET_UNSPECIFIED is PRESET_FAST.
const v1::ColorizeSceneSpec& OptionsOf(v1::Preset preset);

// What was given, over its preset; stages without a size of their own take the scene's. Whatever
// has a value in `given` keeps it, but for enums that are set to "unspecified"; lists and sources
// of colour are taken whole. Additional key views with a range of time become corrections.
v1::ColorizeSceneSpec WithPreset(const v1::ColorizeSceneSpec& given);

// The same for the options of one stage: `spec`'s, over those that `scene` (as WithPreset returns
// it) has for this stage.
void FillStage(const v1::ColorizeSceneSpec& scene, v1::JobSpec* spec);

// Of a film: colours are looked for at the size at which they were learnt, that of the coloured
// frames, up to 800 px (tests/bench/RESULTS.md). A size that was asked for stays, and the paper's
// recipe stays the paper's.
void LearnAtTheSizeOfFrames(int frames_max_side_px, v1::PersonalizeSpec* spec);

}  // namespace color3d
