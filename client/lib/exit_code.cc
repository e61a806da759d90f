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
  const auto code = static_cast<grpc::StatusCode>(job.error().code());
  const bool input_is_wrong =
      code == grpc::StatusCode::INVALID_ARGUMENT || code == grpc::StatusCode::FAILED_PRECONDITION;
  return input_is_wrong ? ExitCode::kBadInput : ExitCode::kJobFailed;
}

}  // namespace color3d::client
