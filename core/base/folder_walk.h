// Walks through folders. What cannot be read is told, and all else is visited: nobody may take a
// folder that could not be read for an empty one.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace color3d {

enum class WalkDepth { kFolder, kBelow };

// Calls `visit` for each entry of the folder, with kBelow also of those below it (a folder before
// what it holds), until it returns false. Symbolic links are visited, not followed. Returns what
// could not be read, "PATH: REASON", without repetition; a folder that is not there is that, too.
std::vector<std::string> WalkFolder(
    const std::filesystem::path& folder,
    WalkDepth depth,
    const std::function<bool(const std::filesystem::directory_entry&)>& visit);

}  // namespace color3d
