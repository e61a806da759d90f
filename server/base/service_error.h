// An Error with what a client program needs to react to it: a stable reason and, for rejected
// requests, one line for each bad field or file. Immutable; thrown by value.
#pragma once

#include <fmt/core.h>

#include <concepts>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/catalogue/error_reasons.h"

namespace color3d {

// `field` is a path in the request or in the scene.
struct FieldViolation {
  std::string field;
  std::string description;
};

class ServiceError : public Error {
 public:
  // With the code that the table of reasons gives.
  ServiceError(ErrorReason reason,
               const std::string& message,
               std::vector<FieldViolation> violations = {})
      : ServiceError(ErrorReasonCode(reason), reason, message, std::move(violations)) {}
  // With another code than the table's.
  ServiceError(ErrorCode code,
               ErrorReason reason,
               const std::string& message,
               std::vector<FieldViolation> violations = {})
      : Error(code, message), reason_(reason), violations_(std::move(violations)) {}
  // The message is formatted by fmt. With violations, format it first.
  template <typename First, typename... Rest>
  requires(!std::convertible_to<First, std::vector<FieldViolation>>) ServiceError(
      ErrorReason reason, fmt::format_string<First, Rest...> message, First&& first, Rest&&... rest)
      : Error(ErrorReasonCode(reason),
              message,
              std::forward<First>(first),
              std::forward<Rest>(rest)...),
        reason_(reason) {}
  template <typename First, typename... Rest>
  requires(!std::convertible_to<First, std::vector<FieldViolation>>)
      ServiceError(ErrorCode code,
                   ErrorReason reason,
                   fmt::format_string<First, Rest...> message,
                   First&& first,
                   Rest&&... rest)
      : Error(code, message, std::forward<First>(first), std::forward<Rest>(rest)...),
        reason_(reason) {}
  ErrorReason reason() const { return reason_; }
  const std::vector<FieldViolation>& violations() const { return violations_; }

 private:
  ErrorReason reason_;
  std::vector<FieldViolation> violations_;
};

// Returns the name of the reason on the wire, or the name of the code if there is no reason.
std::string ReasonOf(const Error& error);

bool HasReason(const std::exception& error, ErrorReason reason);

}  // namespace color3d
