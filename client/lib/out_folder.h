// Paths of files from the server in a folder of the user. Nothing is written outside of it, even
// for malicious names and if it contains symbolic links. Pure functions of the file system.
#pragma once

#include <filesystem>
#include <string>

namespace color3d::client {

// Returns out/NAME and creates its folder. `out` itself may be a symbolic link; folders below it
// may not. Throws Error{kDataLoss} if the name is not a safe relative path, kFailedPrecondition if
// a folder in the path is a symbolic link or a file, or cannot be created.
std::filesystem::path SafePathBelow(const std::filesystem::path& out, const std::string& name);

// Removes `path` unless it is a regular file with a single name, so that opening it for writing
// changes no other file.
void RemoveUnlessPlainFile(const std::filesystem::path& path);

}  // namespace color3d::client
