// What to do with files that people bring as films and that are not read: animated pictures,
// pictures of cinema scanners, other containers. Reads names only.
#pragma once

#include <filesystem>
#include <string>

namespace color3d::client {

// A line that says what the file is and how to make a film of it; empty for other files, by their
// ending.
std::string FilmAdvice(const std::filesystem::path& file);

// The same of the first such file in `folder` or below it, and how many there are of its kind; else
// of pictures or films that lie in a folder deeper down. Begins with "; ", empty where there is
// neither.
std::string FolderAdvice(const std::filesystem::path& folder);

}  // namespace color3d::client
