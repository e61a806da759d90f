// Where files from the server go in a folder of the user's: nothing is written outside of it,
// whatever the server's names are and whatever symbolic links lie in it. Pure functions of the file
// system.
#pragma once

#include <filesystem>
#include <string>

namespace color3d::client {

// out/NAME, whose folder is there afterwards. `out` itself is the user's choice and may be a
// symbolic link; what lies below it may not. Throws Error{kDataLoss} when the name is not a safe
// relative path, kFailedPrecondition when a folder on the way is a symbolic link, is a file or
// cannot be created.
std::filesystem::path PlaceBelow(const std::filesystem::path& out, const std::string& name);

// Removes `path` unless it is a regular file with this one name, so that whoever opens it writes to
// no other file.
void RemoveUnlessPlainFile(const std::filesystem::path& path);

}  // namespace color3d::client
