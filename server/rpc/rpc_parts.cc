#include "server/rpc/rpc_parts.h"

#include <cctype>

#include "core/base/digest.h"
#include "server/planning/job_spec.h"

namespace color3d {

void CheckRequestId(const std::string& request_id) {
  if (request_id.empty()) return;
  bool good = request_id.size() == 36;
  for (size_t i = 0; good && i < request_id.size(); ++i) {
    const bool dash = i == 8 || i == 13 || i == 18 || i == 23;
    good =
        dash ? request_id[i] == '-' : std::isxdigit(static_cast<unsigned char>(request_id[i])) != 0;
  }
  if (!good) {
    throw InvalidArgument(
        "request_id '{}' is not a UUID, e.g. 3f0c9a52-7e4b-4c1d-9b1e-2f6d8a7c5b40",
        request_id.substr(0, 80));
  }
}

std::string DigestOfMessage(const google::protobuf::Message& message) {
  return Sha256Hex(DeterministicBytes(message));
}

}  // namespace color3d
