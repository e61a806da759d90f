// What lies at a path; nothing is thrown where there is nothing. Thread-safe.
#pragma once

#include <filesystem>

namespace color3d::client {

inline bool IsFile(const std::filesystem::path& path) {
  std::error_code none;
  return std::filesystem::is_regular_file(path, none);
}
inline bool IsFolder(const std::filesystem::path& path) {
  std::error_code none;
  return std::filesystem::is_directory(path, none);
}

}  // namespace color3d::client
