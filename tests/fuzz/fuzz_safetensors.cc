// Fuzz target: the safetensors reader.
#include <string_view>

#include "core/weights/safetensors.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/weight_checks.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  return color3d::ReadOrRefuse([&] {
    const std::string_view bytes(reinterpret_cast<const char*>(data), size);
    color3d::WeightMetadata metadata;
    const color3d::WeightMap weights = color3d::ParseSafetensors(bytes, &metadata);
    color3d::CheckAccepted(weights, size);
    // Weights survive writing and reading.
    const std::string written = color3d::SerializeSafetensors(weights, false, metadata);
    if (color3d::SerializeSafetensors(color3d::ParseSafetensors(written), false, metadata) !=
        written) {
      std::abort();
    }
  });
}

namespace color3d {

std::vector<std::string> FuzzSeeds() {
  const WeightMap weights{{"a.weight", {{2, 3}, {1.0f, -2.5f, 0.0f, 4.0f, 640.0f, -3.0f}}},
                          {"b", {{}, {7.0f}}},
                          {"empty", {{0, 4}, {}}}};
  const std::string header = R"({"f64":{"dtype":"F64","shape":[1],"data_offsets":[0,8]},)"
                             R"("bf16":{"dtype":"BF16","shape":[2],"data_offsets":[8,12]},)"
                             R"("i64":{"dtype":"I64","shape":[],"data_offsets":[12,20]},)"
                             R"("bool":{"dtype":"BOOL","shape":[1,1],"data_offsets":[20,21]}})";
  const uint64_t length = header.size();
  return {SerializeSafetensors(weights, false, {{"format", "pt"}}),
          SerializeSafetensors(weights, true),
          SerializeSafetensors({}, false),
          std::string(reinterpret_cast<const char*>(&length), 8) + header + std::string(21, 'x')};
}

}  // namespace color3d
