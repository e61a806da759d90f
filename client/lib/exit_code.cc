#include "client/lib/exit_code.h"

#include "client/lib/rpc_error.h"

namespace color3d::client {

ExitCode ExitCodeOf(ErrorCode code) {
  switch (code) {
    case ErrorCode::kInvalidArgument:
    case ErrorCode::kFailedPrecondition:
    case ErrorCode::kNotFound:
    case ErrorCode::kAlreadyExists:
    case ErrorCode::kUnimplemented:
    case ErrorCode::kOutOfRange:
    case ErrorCode::kUnauthenticated:
    case ErrorCode::kPermissionDenied:
      return ExitCode::kBadInput;
    case ErrorCode::kUnavailable:
    case ErrorCode::kDeadlineExceeded:
      return ExitCode::kUnreachable;
    case ErrorCode::kResourceExhausted:
      return ExitCode::kNoRoom;
    case ErrorCode::kCancelled:
      return ExitCode::kDetached;
    case ErrorCode::kAborted:
    case ErrorCode::kInternal:
    case ErrorCode::kDataLoss:
      return ExitCode::kJobFailed;
  }
  return ExitCode::kJobFailed;
}

ExitCode ExitCodeOf(const v1::Job& job) {
  if (job.state() == v1::Job::STATE_SUCCEEDED || job.state() == v1::Job::STATE_SKIPPED) {
    return ExitCode::kOk;
  }
  switch (static_cast<grpc::StatusCode>(job.error().code())) {
    case grpc::StatusCode::INVALID_ARGUMENT:
    case grpc::StatusCode::FAILED_PRECONDITION:
    case grpc::StatusCode::NOT_FOUND:
      return ExitCode::kBadInput;
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
      return ExitCode::kNoRoom;
    default:
      return ExitCode::kJobFailed;
  }
}

}  // namespace color3d::client
