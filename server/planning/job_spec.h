// Serialised options of jobs, and the options of a stage by its name. Stateless.
#pragma once

#include <google/protobuf/message.h>

#include <string>

#include "color3d/v1/job.pb.h"

namespace color3d {

// Returns equal bytes for equal messages.
std::string DeterministicBytes(const google::protobuf::Message& message);

// Throws Error{kDataLoss} with the name of the job if the bytes are not a JobSpec.
v1::JobSpec ParseSpec(const std::string& bytes, const std::string& job_name);

// Returns the options of the stage `kind`, which becomes the stage of the job.
google::protobuf::Message* MutableStage(v1::JobSpec* spec, const std::string& kind);

}  // namespace color3d
