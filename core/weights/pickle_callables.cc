#include "core/weights/pickle_callables.h"

#include "core/weights/element_type.h"

namespace color3d {

std::optional<int64_t> FindPickleCallable(std::string_view module,
                                          std::string_view name,
                                          bool allow_objects) {
  struct Known {
    std::string_view module, name;
    int64_t callable;
  };
  const auto storage = [](ElementType type) { return kStorageTypes + static_cast<int64_t>(type); };
  const Known kKnown[] = {
      {"collections", "OrderedDict", kOrderedDict},
      {"torch._utils", "_rebuild_tensor_v2", kRebuildTensor},
      {"torch._utils", "_rebuild_tensor", kRebuildTensor},
      {"torch._utils", "_rebuild_parameter", kFirstArgument},
      {"torch._utils", "_rebuild_parameter_with_state", kFirstArgument},
      {"torch", "Size", kFirstArgument},
      {"torch", "FloatStorage", storage(ElementType::kFloat32)},
      {"torch", "HalfStorage", storage(ElementType::kFloat16)},
      {"torch", "BFloat16Storage", storage(ElementType::kBfloat16)},
      {"torch", "DoubleStorage", storage(ElementType::kFloat64)},
      {"torch", "CharStorage", storage(ElementType::kInt8)},
      {"torch", "ByteStorage", storage(ElementType::kUint8)},
      {"torch", "ShortStorage", storage(ElementType::kInt16)},
      {"torch", "IntStorage", storage(ElementType::kInt32)},
      {"torch", "LongStorage", storage(ElementType::kInt64)},
      {"torch", "BoolStorage", storage(ElementType::kBool)},
  };
  for (const Known& known : kKnown) {
    if (known.module == module && known.name == name) return known.callable;
  }
  if (!allow_objects) return std::nullopt;
  if (module == "__torch__" || module.starts_with("__torch__.")) return kScriptClass;
  // TorchScript wraps typed lists, dicts and devices in calls.
  if (module == "torch.jit._pickle" || (module == "torch" && name == "device")) {
    return kFirstArgument;
  }
  return std::nullopt;
}

}  // namespace color3d
