// Fuzz target: point clouds in PLY files.
#include <string_view>

#include "core/scene/formats/point_ply.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace color3d;
  constexpr size_t kMost = 50;
  return ReadOrRefuse([&] {
    const auto points =
        ReadPointPly({reinterpret_cast<const char*>(data), size}, "points.ply", kMost);
    if (points.size() > kMost) std::abort();
    for (const Eigen::Vector3d& point : points) {
      if (!point.allFinite()) std::abort();
    }
  });
}

namespace color3d {

std::vector<std::string> FuzzSeeds() {
  const std::string vertices =
      "element vertex 2\nproperty float x\nproperty float y\nproperty float z\n";
  return {"ply\nformat ascii 1.0\n" + vertices + "property uchar red\nend_header\n" +
              "1 2.5 -3e2 7\nnan 0 0 255\n",
          "ply\r\nformat binary_little_endian 1.0\r\ncomment c\r\n" + vertices +
              "element face 1\nproperty list uchar int vertex_indices\nend_header\r\n" +
              std::string(24, '\x3f'),
          "ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty double z\n"
          "property short x\nproperty uint8 y\nend_header\n" +
              std::string(11, '\x3f'),
          "ply\nformat ascii 1.0\nelement vertex 18446744073709551615\nproperty int x\n"
          "end_header\n"};
}

}  // namespace color3d
