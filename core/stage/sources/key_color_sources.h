// All sources of a key view's colours, in one table.
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
  // Details of the source for the report and for programs. "warnings" is a list of lines that are
  // also shown to the user.
  nlohmann::ordered_json facts = nlohmann::ordered_json::object();
  Image confidence;  // 1 channel, 0..1; empty: 1 everywhere
  Image regions;     // sRGB of any size, the regions of a prompt's phrases; empty: none
};

// "image", "strokes", ... as in stage.proto.
const char* KeyColorSourceName(ColorizeKeyViewOptions::Source source);

// Throws Error: what the source throws, kInvalidArgument when an option of the source is missing.
KeyColorResult SolveKeyColor(const ColorizeKeyViewOptions& options,
                             const KeyPhoto& photo,
                             StageContext& context);

}  // namespace color3d
