// Fuzz target: hints.
#include "core/keycolor/hints/hints.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  return color3d::ReadOrRefuse(
      [&] { color3d::ParseHintsJson(std::string(reinterpret_cast<const char*>(data), size)); });
}

namespace color3d {

std::vector<std::string> FuzzSeeds() {
  return {R"([{"x": 120, "y": 80.5, "radius": 3, "color": "#a0522d"}])",
          R"([{"x":0,"y":0,"color":"#FFFFFF"},{"x":1e3,"y":2,"color":"#000000"}])",
          "[]",
          std::string(2000, '[')};
}

}  // namespace color3d
