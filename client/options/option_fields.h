// The options of a scene by name, "personalize.iterations", as --set and the flags for single
// options give them. What there is, and what each takes, comes from the API itself. Pure functions.
#pragma once

#include <google/protobuf/descriptor.h>

#include <string>
#include <vector>

#include "color3d/v1/colorize_scene.pb.h"

namespace color3d::client {

// "stage.field=value", or "field=value" for what belongs to the whole scene (max_side_px). Enums by
// their names or the part that tells them apart: "solve_chroma.solver=adam". Throws
// Error{kInvalidArgument} naming the option, what it takes, or the option that was probably meant.
void SetOption(const std::string& setting, v1::ColorizeSceneSpec* spec);

// For --help: "64 to 4096 px, default by preset".
std::string DescribeOption(const std::string& name);

// Of `names`, the one that differs from `name` in the fewest letters; empty when none is alike.
std::string Nearest(const std::string& name, const std::vector<std::string>& names);

}  // namespace color3d::client
