// Specs of runs as versions of one coloured scene: their corrections and tone. Pure functions.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "color3d/v1/job.pb.h"

namespace color3d::client {

// Equal for runs that differ in corrections and tone alone. Requires: a colorize_scene job.
std::string WithoutCorrections(const v1::JobSpec& spec);

// Id of a correction: stays the same while others come and go.
std::string CorrectionId(const v1::FurtherKeyView& correction);

// saturation, tint, warmth.
nlohmann::ordered_json ToneJson(const v1::JobSpec& spec);

struct VersionChange {
  std::optional<v1::FurtherKeyView> add;
  std::vector<std::string> remove;  // ids
  std::optional<double> saturation, tint, warmth;
};
// Reads "remove" and "tone" of a change. Throws Error{kInvalidArgument}.
VersionChange ReadVersionChange(const nlohmann::json& change);
// Throws Error{kFailedPrecondition} if a correction to remove is not there (any more).
v1::JobSpec Changed(v1::JobSpec spec, const VersionChange& change);

}  // namespace color3d::client
