// Kind of the file at a path; missing files are no error. Thread-safe.
#pragma once

#include <filesystem>
#include <system_error>

namespace color3d {

inline bool IsFile(const std::filesystem::path& path) {
  std::error_code none;
  return std::filesystem::is_regular_file(path, none);
}
inline bool IsFolder(const std::filesystem::path& path) {
  std::error_code none;
  return std::filesystem::is_directory(path, none);
}

}  // namespace color3d
