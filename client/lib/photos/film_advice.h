// Advice for films in formats that are not read: animated pictures, pictures of cinema scanners,
// other containers. Reads names only.
#pragma once

#include <filesystem>
#include <string>

namespace color3d::client {

// Returns one line that names the format, judged by the extension, and says how to convert the file
// to a film; empty for other files.
std::string FilmAdvice(const std::filesystem::path& file);

// As FilmAdvice for the first such file in `folder` or below it, with the number of files of its
// kind; else for pictures or films in deeper folders. Begins with "; "; empty if there are neither.
std::string FolderAdvice(const std::filesystem::path& folder);

}  // namespace color3d::client
