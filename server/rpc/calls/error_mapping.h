// Maps errors of the project to gRPC: canonical code, one-line message, and machine-readable
// details (ErrorInfo with a stable reason, BadRequest, RetryInfo).
#pragma once

#include <grpcpp/support/status.h>

#include <functional>
#include <string>

#include "core/base/error.h"
#include "google/rpc/status.pb.h"
#include "server/store/job.h"

namespace color3d {

grpc::Status ToGrpcStatus(const Error& error);

// Throws the error that ToGrpcStatus made this status of, without its violations; an error of the
// transport as Error of the same code. Does nothing if the status is OK.
void ThrowIfFailed(const grpc::Status& status);

// Stored error of a job as google.rpc.Status.
google::rpc::Status ToRpcStatus(const JobError& error);

// Runs `body` and returns the status of what it throws. INTERNAL and DATA_LOSS are logged.
grpc::Status Guard(const std::function<void()>& body);

// UNAVAILABLE with RetryInfo.
grpc::Status DrainingStatus();
grpc::Status OverloadedStatus();

}  // namespace color3d
