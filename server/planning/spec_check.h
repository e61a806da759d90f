// Checks of a job's options, before anything is planned: every enum value known, every number,
// list and text within what the proto says of it, every digest well formed, nothing asked for that
// is not built.
#pragma once

#include <string>
#include <vector>

#include "color3d/v1/job.pb.h"
#include "core/base/digest.h"

namespace color3d {

// Of a spec, serialised.
constexpr size_t kMaxSpecBytes = 64 << 10;

// The stage's field name in JobSpec, e.g. "personalize". Throws Error{kInvalidArgument} when the
// spec has no stage.
std::string KindOf(const v1::JobSpec& spec);

// Throws Error: kInvalidArgument naming field, value and range; kUnimplemented naming the kind.
// Names of models and backends are checked by CheckNames (spec_names.h), where the configuration
// is.
void CheckSpec(const v1::JobSpec& spec);

// Every digest that the spec names, without repetition.
std::vector<FileDigest> SpecBlobs(const v1::JobSpec& spec);

}  // namespace color3d
