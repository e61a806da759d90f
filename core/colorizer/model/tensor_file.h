// Colorizer files and training checkpoints: named arrays and facts about them in one safetensors
// file. A SHA-256 over the whole file lets readers refuse damaged or hostile bytes before using
// them. No torch. Pure functions, thread-safe.
//
// The header's __metadata__ holds "format" and "version" (TensorFormat), "facts" (JSON text) and
// "sha256", the digest of the file with 64 zeros in place of these digits.
#pragma once

#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>

#include "core/weights/weight_map.h"

namespace color3d {

struct TensorFormat {
  std::string_view name;  // "color3d.colorizer"
  int version = 1;
  std::string_view older_start;  // first bytes of files of versions before safetensors; empty: none
  std::string_view remedy;       // advice for files that are refused
};

// Version 6: safetensors, colours relative to luminance, positions in space.
inline constexpr TensorFormat kColorizerFormat = {
    "color3d.colorizer", 6, "C3DCOLR1", "personalize the scene again"};
// Version 3: safetensors. A checkpoint that is refused costs no more than training time.
inline constexpr TensorFormat kCheckpointFormat = {
    "color3d.colorizer-training", 3, "C3DCKPT1", "training starts afresh"};

struct TensorFile {
  nlohmann::json facts;
  WeightMap arrays;
  std::set<std::string> half;  // names of arrays to store in half precision
};

std::string WriteTensorFile(const TensorFile& file, const TensorFormat& format);
// Throws Error{kInvalidArgument}, starting with `what` ("the colorizer file"), if the bytes are of
// another kind or version, truncated or changed. Leaves `half` empty.
TensorFile ReadTensorFile(std::string_view bytes,
                          const TensorFormat& format,
                          const std::string& what);

}  // namespace color3d
