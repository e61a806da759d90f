#include "server/rpc/rpc_parts.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <cctype>

#include "core/base/digest.h"

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
  std::string bytes;
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::io::CodedOutputStream coded(&stream);
    coded.SetSerializationDeterministic(true);
    message.SerializeToCodedStream(&coded);
  }
  return Sha256Hex(bytes);
}

}  // namespace color3d
