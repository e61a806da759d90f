// What --preset names: a preset of the server's, or a file of the user's own.
#pragma once

#include <string>

#include "color3d/v1/colorize_scene.pb.h"

namespace color3d::client {

// "fast", "best", "paper".
std::string PresetNames();

// A preset's name gives a spec that names it and leaves the rest to the server. Other text is a
// file that holds a ColorizeSceneSpec in protobuf's text form (`color3d server presets NAME` prints
// one); the server puts it over the preset that its field `preset` names, fast when it names none.
// Throws Error: kNotFound when there is neither, kInvalidArgument with file and line for what is
// wrong in the file.
v1::ColorizeSceneSpec ReadPreset(const std::string& name_or_file);

}  // namespace color3d::client
