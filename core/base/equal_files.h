// Comparison of files by content. Thread-safe.
#pragma once

#include <filesystem>

namespace color3d {

// Returns true for two regular files of equal bytes, false if one cannot be read. Compares sizes
// first.
bool HaveEqualBytes(const std::filesystem::path& one, const std::filesystem::path& other);

}  // namespace color3d
