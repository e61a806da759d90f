// Paths in messages to users: names in a scene or job, never the paths of the server.
// Pure, thread-safe.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <string>

namespace color3d {

// `message` without the paths of these folders, which are absolute or as the server was given them,
// before the names of files in them. A folder that contains another one comes after it.
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
