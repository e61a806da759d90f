// A PNG for pictures that are shown at once: made and read several times faster than the small ones
// of codec.h, and about a tenth larger. Pure.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/parallel.h"

namespace color3d {

// `rgb`: 3 bytes for each pixel, row by row; tagged as sRGB. The bytes do not depend on the number
// of threads.
std::string EncodeQuickPng(const std::vector<uint8_t>& rgb,
                           int width,
                           int height,
                           ThreadPool& pool);

}  // namespace color3d
