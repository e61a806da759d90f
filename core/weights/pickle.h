// The few opcodes of Python's pickle that PyTorch's state dicts and TorchScript modules consist of,
// read into inert values. Nothing is executed: the only callables known are those of the list in
// pickle_callables.cc, each answered by building a value. Format: Python's pickletools.py; opcodes
// up to protocol 4. For this folder only.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/weights/byte_source.h"
#include "core/weights/element_type.h"

namespace color3d {

// Values name each other by index, so neither reading nor freeing a hostile, deeply nested or
// cyclic pickle recurses.
struct PickleValue {
  enum class Kind : uint8_t {
    kNone,
    kBool,     // number
    kInt,      // number
    kFloat,    // the value is not kept
    kText,     // text
    kTuple,    // items
    kList,     // items
    kDict,     // items: key, value, key, value ...
    kGlobal,   // number: which
    kStorage,  // number: index into storages
    kTensor,   // number: index into tensors
    kObject,   // items: the state, when it has one
  };
  Kind kind = Kind::kNone;
  int64_t number = 0;
  std::string_view text;  // into the pickle's bytes
  std::vector<uint32_t> items;
};

// A flat array in a record of the archive.
struct PickleStorage {
  ElementType type = ElementType::kFloat32;
  std::string_view key;  // the record's name
  int64_t count = 0;     // elements
};

// A strided view of a storage; sizes and strides are not negative, but not otherwise checked.
struct PickleTensor {
  uint32_t storage = 0;
  int64_t offset = 0;  // elements
  std::vector<int64_t> shape;
  std::vector<int64_t> strides;  // elements
};

struct PickleGraph {
  std::vector<PickleValue> values;
  std::vector<PickleStorage> storages;
  std::vector<PickleTensor> tensors;
  uint32_t root = 0;

  // The value of a text key of a dict, or nullptr. `dict` may be of any kind.
  const PickleValue* Find(const PickleValue& dict, std::string_view key) const;
};

// `bytes` must outlive the graph. `source` only names the file in messages. `allow_objects`:
// classes of TorchScript (`__torch__...`) become objects; a state dict has none. Throws
// Error{kInvalidArgument} when the pickle is damaged or asks for anything that is not on the list.
PickleGraph ReadPickle(std::string_view bytes, const ByteSource& source, bool allow_objects);

}  // namespace color3d
