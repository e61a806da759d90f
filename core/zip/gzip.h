// Packs bytes as gzip. Pure function.
#pragma once

#include <string>
#include <string_view>

namespace color3d {

// Returns the same bytes for the same input. Throws Error{kInternal} if zlib fails.
std::string Gzip(std::string_view bytes);

}  // namespace color3d
