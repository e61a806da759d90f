// The one place where our errors become gRPC's: canonical code, one-line message, and details that
// programs can read (ErrorInfo with a stable reason, BadRequest, RetryInfo).
#pragma once

#include <grpcpp/support/status.h>

#include <functional>
#include <string>

#include "core/base/error.h"
#include "google/rpc/status.pb.h"
#include "server/store/job.h"

namespace color3d {

grpc::Status ToGrpcStatus(const Error& error);

// A job's stored error as google.rpc.Status.
google::rpc::Status ToRpcStatus(const JobError& error);

// Runs `body`; what it throws becomes the status. Errors of ours (INTERNAL, DATA_LOSS) are logged.
grpc::Status Guard(const std::function<void()>& body);

// UNAVAILABLE with RetryInfo.
grpc::Status DrainingStatus();
grpc::Status OverloadedStatus();

}  // namespace color3d
