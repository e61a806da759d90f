// Reads the opcodes of Python's pickle that PyTorch's state dicts and TorchScript modules use into
// inert values. Executes nothing: the only known callables are listed in pickle_callables.cc, and
// each call builds a value. Format: Python's pickletools.py, opcodes up to protocol 4. For this
// folder only.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/bytes/byte_source.h"
#include "core/weights/element_type.h"

namespace color3d {

// Values refer to each other by index, so that reading and freeing a hostile, deeply nested or
// cyclic pickle never recurses.
struct PickleValue {
  enum class Kind : uint8_t {
    kNone,
    kBool,     // number
    kInt,      // number
    kFloat,    // value is not kept
    kText,     // text
    kTuple,    // items
    kList,     // items
    kDict,     // items: key, value, key, value ...
    kGlobal,   // number: which
    kStorage,  // number: index into storages
    kTensor,   // number: index into tensors
    kObject,   // items: the state, if any
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

// A strided view of a storage. Sizes and strides are non-negative, but otherwise unchecked.
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

  // Returns the value of a text key of a dict, or nullptr. `dict` may be of any kind.
  const PickleValue* Find(const PickleValue& dict, std::string_view key) const;
};

// `bytes` must outlive the graph. `source` names the file in messages. `allow_objects`: accepts
// classes of TorchScript (`__torch__...`) as objects; a state dict has none. Throws
// Error{kInvalidArgument} if the pickle is damaged or uses anything outside the list.
PickleGraph ReadPickle(std::string_view bytes, const ByteSource& source, bool allow_objects);

}  // namespace color3d
