// The safetensors format: u64 header length, a JSON header {name: {dtype, shape, data_offsets}},
// then the data without gaps. https://github.com/huggingface/safetensors#format
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "core/base/bytes/byte_source.h"
#include "core/weights/weight_map.h"

namespace color3d {

// The header's `__metadata__`.
using WeightMetadata = std::map<std::string, std::string>;

// Reads all arrays as float32, for any stored type (F32, F16, BF16, F64, integers, BOOL). Throws
// Error{kInvalidArgument}, naming the file and the reason, if it violates the format. Memory is
// within a small multiple of the file's size. `metadata` may be null.
WeightMap ReadSafetensors(const ByteSource& source, WeightMetadata* metadata = nullptr);
WeightMap ParseSafetensors(std::string_view bytes, WeightMetadata* metadata = nullptr);

// Returns the bytes of a safetensors file, in float32 or, for names for which `half` is true,
// float16. Throws Error{kInvalidArgument} naming an array whose shape and values disagree, or that
// exceeds the range of float16.
std::string SerializeSafetensors(const WeightMap& weights,
                                 const std::function<bool(const std::string& name)>& half,
                                 const WeightMetadata& metadata = {});
// Stores all arrays in the same type.
std::string SerializeSafetensors(const WeightMap& weights,
                                 bool half,
                                 const WeightMetadata& metadata = {});

}  // namespace color3d
