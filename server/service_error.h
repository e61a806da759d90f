// An Error with what a client program needs to react to it: a stable reason and, for rejected
// requests, one line for each bad field or file. Immutable; thrown by value.
#pragma once

#include <fmt/core.h>

#include <concepts>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"

namespace color3d {

// `field` is a path in the request or in the scene.
struct FieldViolation {
  std::string field;
  std::string description;
};

class ServiceError : public Error {
 public:
  // `reason`: UPPER_SNAKE_CASE, stable, e.g. "BLOB_MISSING".
  ServiceError(ErrorCode code,
               std::string reason,
               const std::string& message,
               std::vector<FieldViolation> violations = {})
      : Error(code, message), reason_(std::move(reason)), violations_(std::move(violations)) {}
  // The message as fmt::format puts it together. With violations, format it yourself.
  template <typename First, typename... Rest>
  requires(!std::convertible_to<First, std::vector<FieldViolation>>)
      ServiceError(ErrorCode code,
                   std::string reason,
                   fmt::format_string<First, Rest...> message,
                   First&& first,
                   Rest&&... rest)
      : Error(code, message, std::forward<First>(first), std::forward<Rest>(rest)...),
        reason_(std::move(reason)) {}
  const std::string& reason() const { return reason_; }
  const std::vector<FieldViolation>& violations() const { return violations_; }

 private:
  std::string reason_;
  std::vector<FieldViolation> violations_;
};

// The reason when there is one, else the code's name.
inline std::string ReasonOf(const Error& error) {
  const auto* service_error = dynamic_cast<const ServiceError*>(&error);
  return service_error != nullptr ? service_error->reason() : ErrorCodeName(error.code());
}

}  // namespace color3d
