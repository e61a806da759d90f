// Fuzz target: PyTorch archives, from the ZIP directory to the tensors.
#include <string_view>

#include "core/weights/weight_file.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/weight_checks.h"
#include "tests/support/networks/weight_files.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  return color3d::ReadOrRefuse([&] {
    const std::string_view bytes(reinterpret_cast<const char*>(data), size);
    color3d::CheckAccepted(color3d::ReadWeights(color3d::MemorySource(bytes)), size);
  });
}

namespace color3d {

std::vector<std::string> FuzzSeeds() {
  const WeightMap weights{{"a.weight", {{2, 3}, {1.0f, -2.5f, 0.0f, 4.0f, 640.0f, -3.0f}}},
                          {"b", {{}, {7.0f}}}};
  PickleWriter view;
  view.Op('}').Text("w").Tensor("FloatStorage", "0", 6, 1, {2, 2}, {1, 3}).Op('s');
  PickleWriter module;
  module.Global("__torch__.net", "Net").Op(')').Op('\x81').Op('}').Text("w");
  module.Tensor("HalfStorage", "0", 12, 0, {12}, {1}).Op('s').Text("training").Op('\x88');
  module.Op('s').Op('b');
  const std::string data(24, 'x');
  return {MakeStateDict(weights),
          MakeStateDict(weights, {"params", "HalfStorage"}),
          MakeZip({{"m/data.pkl", view.Finish()}, {"m/data/0", data}}, {.zip64 = true}),
          MakeZip({{"m/data.pkl", module.Finish()},
                   {"m/data/0", data},
                   {"m/code/net.py", "pass", 8},
                   {"m/constants.pkl", "\x80\x02)."}},
                  {.alignment = 1})};
}

}  // namespace color3d
