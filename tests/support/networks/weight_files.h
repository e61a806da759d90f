// Writers of the formats that core/weights reads, well formed or broken, for tests, fuzz corpora
// and benchmarks.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/weights/weight_map.h"

namespace color3d {

struct ZipItem {
  std::string name;
  std::string content;
  uint16_t method = 0;  // 0: stored; other values only change the header
};
struct ZipLayout {
  uint64_t alignment = 64;  // of the content, as PyTorch writes it
  bool zip64 = false;       // all sizes and offsets in zip64 fields
};
std::string MakeZip(const std::vector<ZipItem>& items, const ZipLayout& layout = {});

// Instructions of a pickle, protocol 2, in the order of the calls.
class PickleWriter {
 public:
  PickleWriter() : bytes_("\x80\x02") {}
  PickleWriter& Op(char opcode);
  PickleWriter& Raw(std::string_view bytes);
  PickleWriter& Global(const std::string& module, const std::string& name);
  PickleWriter& Text(std::string_view text);
  PickleWriter& Int(int64_t value);
  PickleWriter& IntTuple(const std::vector<int64_t>& values);
  // A call of _rebuild_tensor_v2 on the storage `key` of `count` elements.
  PickleWriter& Tensor(const std::string& storage_type,
                       const std::string& key,
                       int64_t count,
                       int64_t offset,
                       const std::vector<int64_t>& shape,
                       const std::vector<int64_t>& strides);
  // The pickle, with STOP.
  std::string Finish() const { return bytes_ + "."; }

 private:
  std::string bytes_;
};

struct StateDictLayout {
  std::string wrapper;                        // "params": {'params': state dict}; empty: raw
  std::string storage_type = "FloatStorage";  // Float, Half, BFloat16, Double, Long
  bool with_metadata = true;                  // an OrderedDict whose state is `_metadata`
};
std::string MakeStateDict(const WeightMap& weights, const StateDictLayout& layout = {});

std::vector<int64_t> ContiguousStrides(const std::vector<int64_t>& shape);

}  // namespace color3d
