// Checks the options of a job before planning: enum values are known, numbers, lists and texts
// within the limits of the proto, digests well formed, and the stage is built. Stateless.
#pragma once

#include <string>
#include <vector>

#include "color3d/v1/job.pb.h"
#include "core/base/digest.h"

namespace color3d {

// Maximum size of a serialised spec.
constexpr size_t kMaxSpecBytes = 64 << 10;

// Returns the field name of the stage in JobSpec, e.g. "personalize". Throws
// Error{kInvalidArgument} if the spec has no stage.
std::string KindOf(const v1::JobSpec& spec);

// Throws Error{kInvalidArgument} with field, value and range. Names of models and backends are
// checked by CheckNames (spec_names.h).
void CheckSpec(const v1::JobSpec& spec);

// Returns the digests in the spec, without repetition.
std::vector<FileDigest> SpecBlobs(const v1::JobSpec& spec);

}  // namespace color3d
