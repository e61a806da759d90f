// What a scene's files are, by their names.
#pragma once

#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>

namespace color3d {

// True for the file name endings of splats that we read: .ply .sog .spz, any case.
inline bool HasSplatExtension(std::string_view path) {
  if (path.size() < 4) return false;
  std::string ending(path.substr(path.size() - 4));
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) {
    return static_cast<char>(std::tolower(c));
  });
  return ending == ".ply" || ending == ".sog" || ending == ".spz";
}

}  // namespace color3d
