// Zstandard compression for viewer formats. A pure function.
#pragma once

#include <string>
#include <string_view>

namespace color3d {

// Writes one frame with a window of at most 8 MiB. Throws Error{kResourceExhausted} if memory is
// short.
std::string Zstd(std::string_view plain);

}  // namespace color3d
