// Paths in messages to users: names in a scene or job, never paths of the server. Stateless.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <string>

namespace color3d {

// Removes the paths of these folders before names of files in them from the message. Folders are
// absolute or as given to the server. Requires: a folder comes before its parents.
inline std::string WithoutFolders(std::string message,
                                  std::initializer_list<std::filesystem::path> folders) {
  for (const std::filesystem::path& folder : folders) {
    const std::string prefix = folder.string() + "/";
    if (prefix == "/") continue;
    for (size_t at = message.find(prefix); at != message.npos; at = message.find(prefix, at)) {
      message.erase(at, prefix.size());
    }
  }
  return message;
}

}  // namespace color3d
