// Every way to colour the key view, behind one table: the stage knows none of them by name.
#pragma once

#include <nlohmann/json.hpp>

#include "core/base/image.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/options/key_color_options.h"

namespace color3d {

struct KeyPhoto {
  Image srgb;       // as stored: 1 channel or 3, as captured
  Image luminance;  // 1 channel, L 0..100
};

struct KeyColorResult {
  Image ab;  // 2 channels, Lab units, size of the photo
  // For the report and for programs: what the source tells of itself beyond its name. "warnings" is
  // a list of lines; those are shown to the user, too.
  nlohmann::ordered_json facts = nlohmann::ordered_json::object();
  Image confidence;  // 1 channel, 0..1; empty: sure everywhere
  Image regions;     // sRGB of any size, what was taken for what; empty: nothing to show
};

// "image", "strokes", ... as in stage.proto.
const char* KeyColorSourceName(ColorizeKeyViewOptions::Source source);

// Throws Error: what the source throws, kInvalidArgument when an option that it needs is missing.
KeyColorResult SolveKeyColor(const ColorizeKeyViewOptions& options,
                             const KeyPhoto& photo,
                             StageContext& context);

}  // namespace color3d
