// Zstandard, for the formats that are packed with it. A pure function.
#pragma once

#include <string>
#include <string_view>

namespace color3d {

// One frame of at most an 8 MiB window. Throws Error{kResourceExhausted} where memory is short.
std::string Zstd(std::string_view plain);

}  // namespace color3d
