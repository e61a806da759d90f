// Fuzz target: the pickle machine and the use of its values. The input is data.pkl of a valid
// archive with one storage; an odd first byte makes it TorchScript.
#include <string_view>

#include "core/weights/weight_file.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/weight_checks.h"
#include "tests/support/networks/weight_files.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return 0;
  const std::string pickle(reinterpret_cast<const char*>(data) + 1, size - 1);
  std::vector<color3d::ZipItem> items{{"m/data.pkl", pickle}, {"m/data/0", std::string(64, 'x')}};
  if (data[0] & 1) items.push_back({"m/constants.pkl", ""});
  const std::string bytes = color3d::MakeZip(items, {.alignment = 1});
  return color3d::ReadOrRefuse([&] {
    color3d::CheckAccepted(color3d::ReadWeights(color3d::MemorySource(bytes)), bytes.size());
  });
}

namespace color3d {

std::vector<std::string> FuzzSeeds() {
  PickleWriter dict;
  dict.Global("collections", "OrderedDict").Op(')').Op('R').Raw("q\x01").Op('(').Text("w");
  dict.Tensor("FloatStorage", "0", 16, 1, {2, 2}, {1, 3}).Raw("q\x02").Text("tied").Raw("h\x02");
  dict.Text("step").Int(300).Text("big").Int(int64_t{1} << 40).Op('u');
  dict.Op('}').Text("_metadata").Op('}').Op('s').Op('b');
  PickleWriter wrapped;
  wrapped.Op('}').Text("params").Op('}').Text("w");
  wrapped.Tensor("LongStorage", "0", 8, 0, {8, 1}, {1, 1}).Op('s').Op('s');
  wrapped.Text("losses").Op(']').Raw("(G12345678").Op('e').Op('s');
  wrapped.Text("shape").Global("torch", "Size").IntTuple({1, 2}).Op('\x85').Op('R').Op('s');
  PickleWriter module;
  module.Global("__torch__.net", "Net").Op(')').Op('\x81').Raw("q\x05").Op('}').Text("child");
  module.Global("__torch__.net", "Child").Op(')').Op('\x81').Op('}').Text("w");
  module.Tensor("BFloat16Storage", "0", 32, 0, {4, 8}, {8, 1}).Op('s').Op('b').Op('s').Op('b');
  PickleWriter stacked;
  stacked.Text("collections").Op('\x94').Text("OrderedDict").Op('\x93').Op(')').Op('R').Op('N');
  return {std::string("\0", 1) + dict.Finish(),
          std::string("\0", 1) + wrapped.Finish(),
          "\1" + module.Finish(),
          "\1" + stacked.Finish()};
}

}  // namespace color3d
