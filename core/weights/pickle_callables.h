// Callables that a pickle may use: a closed list. Each call builds an inert value and runs no code.
// For this folder only.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace color3d {

// Number of a kGlobal value. Storage types include their number format.
enum PickleCallable : int64_t {
  kOrderedDict,    // collections.OrderedDict()
  kRebuildTensor,  // torch._utils._rebuild_tensor_v2(storage, offset, size, stride, ...)
  kFirstArgument,  // wrapper; the value is its first argument
  kScriptClass,    // __torch__.X, inert
  kStorageTypes,   // + ElementType
};

// Returns nullopt if the name is not in the list. `allow_objects`: includes classes of TorchScript.
std::optional<int64_t> FindPickleCallable(std::string_view module,
                                          std::string_view name,
                                          bool allow_objects);

}  // namespace color3d
