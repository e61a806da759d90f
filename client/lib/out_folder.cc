#include "client/lib/out_folder.h"

#include <system_error>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d::client {
namespace fs = std::filesystem;

fs::path SafePathBelow(const fs::path& out, const std::string& name) {
  if (!IsSafeRelativePath(name)) {
    throw Error(ErrorCode::kDataLoss,
                "the server names a file '{}', which is not safe to write; nothing was written",
                name);
  }
  std::error_code error;
  if (!out.empty()) fs::create_directories(out, error);
  fs::path folder = out;
  for (const fs::path& part : fs::path(name).parent_path()) {
    folder /= part;
    const fs::file_status status = fs::symlink_status(folder, error);
    if (fs::is_directory(status)) continue;
    if (fs::is_symlink(status)) {
      throw Error(ErrorCode::kFailedPrecondition,
                  "{} is a symbolic link, and results would be written where it leads; remove it, "
                  "or name another folder with -o",
                  folder.string());
    }
    if (fs::exists(status)) {
      throw Error(ErrorCode::kFailedPrecondition,
                  "{} is a file where a folder of results goes; remove it, or name another folder "
                  "with -o",
                  folder.string());
    }
    fs::create_directory(folder, error);
    if (error) {
      throw Error(ErrorCode::kFailedPrecondition,
                  "cannot create the folder {}: {}",
                  folder.string(),
                  error.message());
    }
  }
  return out / name;
}

void RemoveUnlessPlainFile(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::symlink_status(path, error);
  if (!fs::exists(status)) return;
  if (fs::is_regular_file(status) && fs::hard_link_count(path, error) == 1) return;
  if (!fs::is_directory(status)) fs::remove(path, error);
}

}  // namespace color3d::client
