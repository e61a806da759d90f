// Reads artifacts that are JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "core/base/error.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

// Error{kInvalidArgument} with the name of the artifact and the remedy.
Error DamagedArtifact(std::string_view name, const nlohmann::json::exception& error);

// Returns what `read` makes of the JSON. Throws DamagedArtifact for text that is not JSON or does
// not have the fields that `read` needs.
template <typename Read>
auto ParseArtifact(std::string_view name, std::string_view text, const Read& read) {
  try {
    return read(nlohmann::ordered_json::parse(text));
  } catch (const nlohmann::json::exception& e) {
    throw DamagedArtifact(name, e);
  }
}

// As above, for an artifact among the inputs.
template <typename Read>
auto ParseArtifact(const StageContext& context, const std::string& name, const Read& read) {
  return ParseArtifact(name, context.ReadInput(name), read);
}

}  // namespace color3d
