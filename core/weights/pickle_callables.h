// What a pickle may ask to be called: a closed list, each answered by building an inert value,
// never by running anything. For this folder only.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace color3d {

// The number of a kGlobal value. Storage types stand for themselves and carry their number format.
enum PickleCallable : int64_t {
  kOrderedDict,    // collections.OrderedDict()
  kRebuildTensor,  // torch._utils._rebuild_tensor_v2(storage, offset, size, stride, ...)
  kFirstArgument,  // a wrapper whose first argument is what counts
  kScriptClass,    // __torch__.X, inert
  kStorageTypes,   // + ElementType
};

// nullopt when the name is not on the list. `allow_objects`: TorchScript's classes are, too.
std::optional<int64_t> FindPickleCallable(std::string_view module,
                                          std::string_view name,
                                          bool allow_objects);

}  // namespace color3d
