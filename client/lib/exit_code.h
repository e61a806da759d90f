// Exit statuses of the program. Scripts rely on these numbers.
#pragma once

#include "color3d/v1/job.pb.h"
#include "core/base/error.h"

namespace color3d::client {

enum class ExitCode {
  kOk = 0,
  kJobFailed = 1,    // the job failed or was cancelled; also our own bugs
  kBadInput = 2,     // wrong usage or wrong input: the same command will fail again
  kUnreachable = 3,  // no server, or it is shutting down: try again
  kNoRoom = 4,       // disk, memory or queue is full
  kDetached = 130,   // Ctrl-C: the job goes on
};

ExitCode ExitCodeOf(ErrorCode code);

// Exit status for a finished job. kBadInput if it failed because of its input.
ExitCode ExitCodeOf(const v1::Job& job);

}  // namespace color3d::client
