// Methods of all services that the proto files below proto/color3d/v1 and proto/google/bytestream
// declare. Requires: the program links the generated code of these files.
#pragma once

#include <google/protobuf/descriptor.h>

#include <filesystem>
#include <stdexcept>
#include <vector>

namespace color3d::testing {

inline std::vector<const google::protobuf::MethodDescriptor*> AllRpcMethods(
    const std::filesystem::path& proto_folder) {
  std::vector<const google::protobuf::MethodDescriptor*> methods;
  for (const char* package : {"color3d/v1", "google/bytestream"}) {
    for (const auto& entry : std::filesystem::directory_iterator(proto_folder / package)) {
      if (entry.path().extension() != ".proto") continue;
      const std::string name = std::filesystem::relative(entry.path(), proto_folder).string();
      const auto* file = google::protobuf::DescriptorPool::generated_pool()->FindFileByName(name);
      if (file == nullptr) throw std::runtime_error(name + " is not linked");
      for (int s = 0; s < file->service_count(); ++s) {
        for (int m = 0; m < file->service(s)->method_count(); ++m) {
          methods.push_back(file->service(s)->method(m));
        }
      }
    }
  }
  return methods;
}

}  // namespace color3d::testing
