// The argument of --preset: a preset of the server, or a preset file.
#pragma once

#include <string>

#include "color3d/v1/colorize_scene.pb.h"

namespace color3d::client {

// Returns "fast, best, paper".
std::string PresetNames();

// Returns a spec that names the preset, or the ColorizeSceneSpec in a file in protobuf's text
// format (`color3d server presets NAME` prints one). The server fills unset fields from the preset
// in its field `preset`, by default fast. Throws Error: kNotFound if there is neither preset nor
// file, kInvalidArgument with file and line for errors in the file.
v1::ColorizeSceneSpec ReadPreset(const std::string& name_or_file);

}  // namespace color3d::client
