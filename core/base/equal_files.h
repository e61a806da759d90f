// Whether files are copies of each other. Thread-safe.
#pragma once

#include <filesystem>

namespace color3d {

// True for two regular files of equal bytes; false where one cannot be read. Compares sizes first.
bool HaveEqualBytes(const std::filesystem::path& one, const std::filesystem::path& other);

}  // namespace color3d
