// Base64 (RFC 4648), for data embedded in HTML pages. Pure.
#pragma once

#include <string>
#include <string_view>

namespace color3d {

std::string Base64(std::string_view bytes);

}  // namespace color3d
