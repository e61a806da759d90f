// Names and file name endings in lower case. Pure function, thread-safe.
#pragma once

#include <string>
#include <string_view>

namespace color3d {

// `text` with A-Z as a-z. All other bytes stay, those of UTF-8 too, whatever the locale.
inline std::string LowerCase(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

}  // namespace color3d
