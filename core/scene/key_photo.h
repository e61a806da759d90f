// The photo that is coloured as the key view: at full size, unlike all others, and therefore only
// where memory allows. Pure functions, thread-safe.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "core/base/image.h"

namespace color3d {

// Throws Error{kResourceExhausted} with the numbers when a photo of this size (px) takes more than
// `memory_bytes` as the key view. Any photo may become it.
void RequireKeyViewMemory(const std::string& file, int width, int height, int64_t memory_bytes);

// ReadImage's picture, after RequireKeyViewMemory for its size.
Image ReadKeyPhoto(const std::filesystem::path& file, int64_t memory_bytes);

}  // namespace color3d
