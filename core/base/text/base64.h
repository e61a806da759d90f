// RFC 4648, for what stands inside of pages. Pure.
#pragma once

#include <string>
#include <string_view>

namespace color3d {

std::string Base64(std::string_view bytes);

}  // namespace color3d
