// The options of a job as the store keeps them, and its stage's by name.
#pragma once

#include <google/protobuf/message.h>

#include <string>

#include "color3d/v1/job.pb.h"

namespace color3d {

// Equal messages give equal bytes.
std::string DeterministicBytes(const google::protobuf::Message& message);

// Throws Error{kDataLoss} naming the job when the bytes are no JobSpec.
v1::JobSpec ParseSpec(const std::string& bytes, const std::string& job_name);

// The options of the stage `kind`, which becomes the job's stage if it was not.
google::protobuf::Message* MutableStage(v1::JobSpec* spec, const std::string& kind);

}  // namespace color3d
