// Photo of the key view: coloured at full size, unlike all others, if memory allows. Pure
// functions, thread-safe.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "core/base/image.h"

namespace color3d {

// Throws Error{kResourceExhausted} with the numbers if a photo of this size (px) needs more than
// `memory_bytes` as the key view. Checked for every photo, since any may be chosen.
void RequireKeyViewMemory(const std::string& file, int width, int height, int64_t memory_bytes);

// ReadImage after RequireKeyViewMemory for the size of the picture.
Image ReadKeyPhoto(const std::filesystem::path& file, int64_t memory_bytes);

}  // namespace color3d
