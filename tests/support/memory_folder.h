// For tests that write many small files.
#pragma once

#include <filesystem>

namespace color3d {

// Where files cost no disk, if the machine has such a place.
inline std::filesystem::path MemoryFolder() {
  std::error_code error;
  const std::filesystem::path memory = "/dev/shm";
  return std::filesystem::is_directory(memory, error) ? memory
                                                      : std::filesystem::temp_directory_path();
}

}  // namespace color3d
