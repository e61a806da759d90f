// A colorizer's options in its file and in checkpoints.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "core/colorizer/colorizer.h"

namespace color3d {

nlohmann::json JsonFromOptions(const ColorizerOptions& options);
// Options that the JSON does not name keep their defaults. Throws Error{kInvalidArgument} or
// nlohmann::json::exception on anything else.
ColorizerOptions OptionsFromJson(const nlohmann::json& json);

}  // namespace color3d
