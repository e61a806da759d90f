#include "server/rpc/calls/error_mapping.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <optional>

#include "core/base/text/utf8.h"
#include "google/rpc/error_details.pb.h"
#include "server/base/service_error.h"

namespace color3d {
namespace {

// Trailers share gRPC's 8 KiB limit on metadata: details are cut to fit.
constexpr size_t kMaxViolationBytes = 2500;
constexpr size_t kMaxMessageBytes = 700;

grpc::StatusCode GrpcCode(ErrorCode code) {
  switch (code) {
    case ErrorCode::kCancelled:
      return grpc::StatusCode::CANCELLED;
    case ErrorCode::kInvalidArgument:
      return grpc::StatusCode::INVALID_ARGUMENT;
    case ErrorCode::kDeadlineExceeded:
      return grpc::StatusCode::DEADLINE_EXCEEDED;
    case ErrorCode::kNotFound:
      return grpc::StatusCode::NOT_FOUND;
    case ErrorCode::kAlreadyExists:
      return grpc::StatusCode::ALREADY_EXISTS;
    case ErrorCode::kFailedPrecondition:
      return grpc::StatusCode::FAILED_PRECONDITION;
    case ErrorCode::kResourceExhausted:
      return grpc::StatusCode::RESOURCE_EXHAUSTED;
    case ErrorCode::kAborted:
      return grpc::StatusCode::ABORTED;
    case ErrorCode::kUnimplemented:
      return grpc::StatusCode::UNIMPLEMENTED;
    case ErrorCode::kInternal:
      return grpc::StatusCode::INTERNAL;
    case ErrorCode::kUnavailable:
      return grpc::StatusCode::UNAVAILABLE;
    case ErrorCode::kDataLoss:
      return grpc::StatusCode::DATA_LOSS;
    case ErrorCode::kOutOfRange:
      return grpc::StatusCode::OUT_OF_RANGE;
    case ErrorCode::kUnauthenticated:
      return grpc::StatusCode::UNAUTHENTICATED;
    case ErrorCode::kPermissionDenied:
      return grpc::StatusCode::PERMISSION_DENIED;
  }
  return grpc::StatusCode::INTERNAL;
}

ErrorCode CodeOf(grpc::StatusCode code) {
  using enum ErrorCode;
  for (const ErrorCode one : {kCancelled,
                              kInvalidArgument,
                              kDeadlineExceeded,
                              kNotFound,
                              kAlreadyExists,
                              kFailedPrecondition,
                              kResourceExhausted,
                              kAborted,
                              kUnimplemented,
                              kUnavailable,
                              kDataLoss,
                              kOutOfRange,
                              kUnauthenticated,
                              kPermissionDenied}) {
    if (GrpcCode(one) == code) return one;
  }
  return kInternal;
}

google::rpc::Status Build(ErrorCode code,
                          const std::string& reason,
                          const std::string& message,
                          const std::vector<FieldViolation>& violations) {
  google::rpc::Status status;
  status.set_code(GrpcCode(code));
  // Trailers are text, but paths may contain any byte.
  std::string text = CleanUtf8(message, kMaxMessageBytes);
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 32; }, ' ');
  status.set_message(text);
  google::rpc::ErrorInfo info;
  info.set_reason(reason);
  info.set_domain("color3d");
  status.add_details()->PackFrom(info);
  if (reason == ErrorReasonName(ErrorReason::kQuotaExceeded)) {
    google::rpc::QuotaFailure failure;
    for (const FieldViolation& violation : violations) {
      auto* entry = failure.add_violations();
      entry->set_subject(CleanUtf8(violation.field));
      entry->set_description(CleanUtf8(violation.description));
    }
    status.add_details()->PackFrom(failure);
  } else if (!violations.empty()) {
    google::rpc::BadRequest bad;
    size_t bytes = 0;
    for (const FieldViolation& violation : violations) {
      bytes += violation.field.size() + violation.description.size() + 8;
      if (bytes > kMaxViolationBytes) break;
      auto* entry = bad.add_field_violations();
      entry->set_field(CleanUtf8(violation.field));
      entry->set_description(CleanUtf8(violation.description));
    }
    status.add_details()->PackFrom(bad);
  }
  if (code == ErrorCode::kResourceExhausted || code == ErrorCode::kUnavailable) {
    google::rpc::RetryInfo retry;
    retry.mutable_retry_delay()->set_seconds(code == ErrorCode::kUnavailable ? 2 : 30);
    status.add_details()->PackFrom(retry);
  }
  return status;
}

grpc::Status ToGrpc(const google::rpc::Status& status) {
  return {
      static_cast<grpc::StatusCode>(status.code()), status.message(), status.SerializeAsString()};
}

}  // namespace

grpc::Status ToGrpcStatus(const Error& error) {
  const auto* service_error = dynamic_cast<const ServiceError*>(&error);
  static const std::vector<FieldViolation> kNone;
  return ToGrpc(Build(error.code(),
                      ReasonOf(error),
                      error.what(),
                      service_error != nullptr ? service_error->violations() : kNone));
}

void ThrowIfFailed(const grpc::Status& status) {
  if (status.ok()) return;
  const ErrorCode code = CodeOf(status.error_code());
  google::rpc::Status details;
  if (details.ParseFromString(status.error_details())) {
    for (const google::protobuf::Any& any : details.details()) {
      google::rpc::ErrorInfo info;
      if (!any.UnpackTo(&info)) continue;
      const std::optional<ErrorReason> reason = ErrorReasonFromName(info.reason());
      if (reason) throw ServiceError(code, *reason, status.error_message());
    }
  }
  throw Error(code, status.error_message());
}

google::rpc::Status ToRpcStatus(const JobError& error) {
  return Build(error.code, error.reason, error.message, {});
}

grpc::Status Guard(const std::function<void()>& body) {
  try {
    body();
    return grpc::Status::OK;
  } catch (const Error& e) {
    if (e.code() == ErrorCode::kInternal || e.code() == ErrorCode::kDataLoss) {
      spdlog::error("{}: {}", ErrorCodeName(e.code()), e.what());
    }
    return ToGrpcStatus(e);
  } catch (const std::bad_alloc&) {
    spdlog::error("out of memory while answering an RPC");
    return ToGrpcStatus(Error(ErrorCode::kResourceExhausted, "the server is out of memory"));
  } catch (const std::exception& e) {
    spdlog::error("unexpected: {}", e.what());
    return ToGrpcStatus(Error(ErrorCode::kInternal, "unexpected: {}", e.what()));
  }
}

grpc::Status DrainingStatus() {
  return ToGrpcStatus(ServiceError(ErrorReason::kDraining,
                                   "the server is shutting down; try again when it is back"));
}

grpc::Status OverloadedStatus() {
  return ToGrpcStatus(
      ServiceError(ErrorReason::kOverloaded, "too many requests wait; try again shortly"));
}

}  // namespace color3d
