// Directory walks that report unreadable entries and visit all others, so that an unreadable folder
// is never mistaken for an empty one.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace color3d {

enum class WalkDepth { kFolder, kBelow };

// Calls `visit` for each entry of the folder, with kBelow also for entries of subfolders (a folder
// before its contents), until it returns false. Visits symbolic links without following them.
// Returns the entries that could not be read as "PATH: REASON", without repetition; a missing
// folder is one of them.
std::vector<std::string> WalkFolder(
    const std::filesystem::path& folder,
    WalkDepth depth,
    const std::function<bool(const std::filesystem::directory_entry&)>& visit);

}  // namespace color3d
