// ASCII lower case for names and file extensions. Pure function, thread-safe.
#pragma once

#include <string>
#include <string_view>

namespace color3d {

// Replaces A-Z by a-z. All other bytes, including UTF-8, are unchanged in every locale.
inline std::string LowerCase(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

}  // namespace color3d
