// The one error type of the method library, the stores and the workers.
// Thrown by value, caught by const reference; immutable, so safe to share between threads.
#pragma once

#include <fmt/core.h>

#include <stdexcept>
#include <string>
#include <utility>

namespace color3d {

// Same meaning as the canonical codes of gRPC, without depending on gRPC.
enum class ErrorCode {
  kCancelled,
  kInvalidArgument,  // the input is wrong whatever the state of the system
  kDeadlineExceeded,
  kNotFound,
  kAlreadyExists,
  kFailedPrecondition,  // right input, wrong state: another step must come first
  kResourceExhausted,   // disk, memory, quota
  kAborted,             // lost a race (a lease, an etag): start again
  kUnimplemented,
  kInternal,     // a bug of this program
  kUnavailable,  // try again later
  kDataLoss,     // stored bytes differ from those written
  // Appended, because stored jobs contain the numbers of the codes above.
  kOutOfRange,        // the position is outside the stored range
  kUnauthenticated,   // no valid credentials
  kPermissionDenied,  // valid credentials that do not allow the call
};

// `message` names the offending value and the remedy, in one line.
class Error : public std::runtime_error {
 public:
  Error(ErrorCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
  // The message as formatted by fmt::format.
  template <typename First, typename... Rest>
  Error(ErrorCode code, fmt::format_string<First, Rest...> message, First&& first, Rest&&... rest)
      : Error(code, fmt::format(message, std::forward<First>(first), std::forward<Rest>(rest)...)) {
  }
  ErrorCode code() const { return code_; }

 private:
  ErrorCode code_;
};

inline const char* ErrorCodeName(ErrorCode code) {
  switch (code) {
    case ErrorCode::kCancelled:
      return "CANCELLED";
    case ErrorCode::kInvalidArgument:
      return "INVALID_ARGUMENT";
    case ErrorCode::kDeadlineExceeded:
      return "DEADLINE_EXCEEDED";
    case ErrorCode::kNotFound:
      return "NOT_FOUND";
    case ErrorCode::kAlreadyExists:
      return "ALREADY_EXISTS";
    case ErrorCode::kFailedPrecondition:
      return "FAILED_PRECONDITION";
    case ErrorCode::kResourceExhausted:
      return "RESOURCE_EXHAUSTED";
    case ErrorCode::kAborted:
      return "ABORTED";
    case ErrorCode::kUnimplemented:
      return "UNIMPLEMENTED";
    case ErrorCode::kInternal:
      return "INTERNAL";
    case ErrorCode::kUnavailable:
      return "UNAVAILABLE";
    case ErrorCode::kDataLoss:
      return "DATA_LOSS";
    case ErrorCode::kOutOfRange:
      return "OUT_OF_RANGE";
    case ErrorCode::kUnauthenticated:
      return "UNAUTHENTICATED";
    case ErrorCode::kPermissionDenied:
      return "PERMISSION_DENIED";
  }
  return "INTERNAL";
}

inline Error InvalidArgument(const std::string& message) {
  return Error(ErrorCode::kInvalidArgument, message);
}
// Formats the message with fmt.
template <typename First, typename... Rest>
Error InvalidArgument(fmt::format_string<First, Rest...> message, First&& first, Rest&&... rest) {
  return Error(ErrorCode::kInvalidArgument,
               fmt::format(message, std::forward<First>(first), std::forward<Rest>(rest)...));
}

}  // namespace color3d
