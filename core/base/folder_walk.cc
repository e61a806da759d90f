#include "core/base/folder_walk.h"

#include <system_error>
#include <utility>

namespace color3d {
namespace fs = std::filesystem;
namespace {

struct Walk {
  const WalkDepth depth;
  const std::function<bool(const fs::directory_entry&)>& visit;
  std::vector<std::string> unreadable;
  bool stopped = false;

  void Note(const fs::path& path, const std::error_code& error) {
    unreadable.push_back(path.string() + ": " + error.message());
  }

  void Folder(const fs::path& folder) {
    std::error_code error;
    for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
      if (!visit(*it)) {
        stopped = true;
        return;
      }
      if (depth == WalkDepth::kFolder) continue;
      std::error_code unknown;
      const bool is_folder = fs::is_directory(it->symlink_status(unknown));
      // An entry removed in the meantime is not an error.
      if (unknown && unknown != std::errc::no_such_file_or_directory) Note(it->path(), unknown);
      if (is_folder) Folder(it->path());
      if (stopped) return;
    }
    if (error) Note(folder, error);
  }
};

}  // namespace

std::vector<std::string> WalkFolder(const fs::path& folder,
                                    WalkDepth depth,
                                    const std::function<bool(const fs::directory_entry&)>& visit) {
  Walk walk{depth, visit, {}, false};
  walk.Folder(folder);
  return std::move(walk.unreadable);
}

}  // namespace color3d
