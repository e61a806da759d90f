// A folder for tests that write many small files.
#pragma once

#include <filesystem>

namespace color3d {

// Returns a folder in memory, if the machine has one.
inline std::filesystem::path MemoryFolder() {
  std::error_code error;
  const std::filesystem::path memory = "/dev/shm";
  return std::filesystem::is_directory(memory, error) ? memory
                                                      : std::filesystem::temp_directory_path();
}

}  // namespace color3d
