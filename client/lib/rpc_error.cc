#include "client/lib/rpc_error.h"

#include <algorithm>

#include "google/rpc/error_details.pb.h"

namespace color3d::client {

ErrorCode ErrorCodeOf(grpc::StatusCode code) {
  switch (code) {
    case grpc::StatusCode::CANCELLED:
      return ErrorCode::kCancelled;
    case grpc::StatusCode::INVALID_ARGUMENT:
    case grpc::StatusCode::OUT_OF_RANGE:
      return ErrorCode::kInvalidArgument;
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      return ErrorCode::kDeadlineExceeded;
    case grpc::StatusCode::NOT_FOUND:
      return ErrorCode::kNotFound;
    case grpc::StatusCode::ALREADY_EXISTS:
      return ErrorCode::kAlreadyExists;
    case grpc::StatusCode::FAILED_PRECONDITION:
    case grpc::StatusCode::PERMISSION_DENIED:
    case grpc::StatusCode::UNAUTHENTICATED:
      return ErrorCode::kFailedPrecondition;
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
      return ErrorCode::kResourceExhausted;
    case grpc::StatusCode::ABORTED:
      return ErrorCode::kAborted;
    case grpc::StatusCode::UNIMPLEMENTED:
      return ErrorCode::kUnimplemented;
    case grpc::StatusCode::UNAVAILABLE:
      return ErrorCode::kUnavailable;
    case grpc::StatusCode::DATA_LOSS:
      return ErrorCode::kDataLoss;
    default:
      return ErrorCode::kInternal;
  }
}

RpcError::RpcError(const grpc::Status& status)
    : Error(ErrorCodeOf(status.error_code()),
            status.error_message().empty() ? "the server gave no reason" : status.error_message()),
      grpc_code_(status.error_code()) {
  google::rpc::Status details;
  if (!details.ParseFromString(status.error_details())) return;
  for (const google::protobuf::Any& any : details.details()) {
    google::rpc::ErrorInfo info;
    google::rpc::BadRequest bad;
    google::rpc::QuotaFailure quota;
    google::rpc::RetryInfo retry;
    if (any.UnpackTo(&info)) {
      reason_ = info.reason();
    } else if (any.UnpackTo(&retry)) {
      retry_delay_ = std::chrono::seconds(retry.retry_delay().seconds());
    } else if (any.UnpackTo(&quota)) {
      for (const auto& violation : quota.violations()) {
        violations_.push_back({violation.subject(), violation.description()});
      }
    } else if (any.UnpackTo(&bad)) {
      for (const auto& violation : bad.field_violations()) {
        violations_.push_back({violation.field(), violation.description()});
      }
    }
  }
}

bool RpcError::IsTransient() const {
  return grpc_code_ == grpc::StatusCode::UNAVAILABLE ||
         (grpc_code_ == grpc::StatusCode::CANCELLED && reason_.empty());
}

bool RpcError::IsTurnedAway() const {
  if (grpc_code_ != grpc::StatusCode::RESOURCE_EXHAUSTED || retry_delay_.count() <= 0) return false;
  // Only its owner can reduce the amount stored.
  const bool is_full = std::ranges::any_of(violations_, [](const auto& entry) {
    return entry.field.ends_with("stored_bytes") || entry.field.ends_with(" scenes");
  });
  return HasReason(ErrorReason::kQueueFull) || HasReason(ErrorReason::kTooManyStreams) ||
         (HasReason(ErrorReason::kQuotaExceeded) && !is_full);
}

bool RpcError::IsUnreachable() const {
  const bool code = grpc_code_ == grpc::StatusCode::UNAVAILABLE ||
                    grpc_code_ == grpc::StatusCode::DEADLINE_EXCEEDED;
  return code && reason_.empty();
}

void ThrowIfFailed(const grpc::Status& status) {
  if (!status.ok()) throw RpcError(status);
}

std::string DescribeStatus(const google::rpc::Status& status) {
  const ErrorCode code = ErrorCodeOf(static_cast<grpc::StatusCode>(status.code()));
  return std::string(ErrorCodeName(code)) + ": " + status.message();
}

}  // namespace color3d::client
