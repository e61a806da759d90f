#include "server/base/service_error.h"

namespace color3d {

std::string ReasonOf(const Error& error) {
  const auto* service_error = dynamic_cast<const ServiceError*>(&error);
  return service_error != nullptr ? ErrorReasonName(service_error->reason())
                                  : ErrorCodeName(error.code());
}

bool HasReason(const std::exception& error, ErrorReason reason) {
  const auto* service_error = dynamic_cast<const ServiceError*>(&error);
  return service_error != nullptr && service_error->reason() == reason;
}

}  // namespace color3d
