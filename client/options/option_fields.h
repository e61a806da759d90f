// Options of a scene by name, e.g. "personalize.iterations", for --set and the flags of single
// options. Names and ranges come from the API. Pure functions.
#pragma once

#include <google/protobuf/descriptor.h>

#include <string>
#include <vector>

#include "color3d/v1/colorize_scene.pb.h"

namespace color3d::client {

// Applies "stage.field=value", or "field=value" for options of the whole scene (max_side_px). Enum
// values may omit their prefix: "solve_chroma.solver=adam". Throws Error{kInvalidArgument} with the
// option and its range, or with the most similar option.
void SetOption(const std::string& setting, v1::ColorizeSceneSpec* spec);

// Returns range and default for --help: "64 to 4096 px, default by preset".
std::string DescribeOption(const std::string& name);

// Returns the entry of `names` with the smallest edit distance to `name`; empty if none is similar.
std::string Nearest(const std::string& name, const std::vector<std::string>& names);

}  // namespace color3d::client
