#include "server/storage/data_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d {
namespace fs = std::filesystem;

std::string BlobPlaceOf(const DataPaths& paths) {
  std::error_code error;
  if (!fs::exists(paths.BlobPlace(), error)) return "";
  std::string name = ReadFile(paths.BlobPlace());
  while (name.ends_with('\n')) name.pop_back();
  return name;
}

void PrepareDataFolder(const DataPaths& paths) {
  std::error_code error;
  const bool is_fresh = !fs::exists(paths.root, error);
  for (const fs::path& folder :
       {paths.root, paths.Blobs(), paths.Uploads(), paths.Scratch(), paths.JobLogs()}) {
    if (fs::create_directories(folder, error)) SyncFolder(folder.parent_path());
    if (error || !fs::is_directory(folder)) {
      throw Error(ErrorCode::kFailedPrecondition,
                  "cannot create the data directory {}: {}; choose another --data-dir or change "
                  "its permissions",
                  folder.string(),
                  error ? error.message() : "it is not a folder");
    }
    // Scenes are private: the folder is closed to others, and a new one also to the group.
    struct stat status {};
    if (folder == paths.root && ::stat(folder.c_str(), &status) == 0) {
      ::chmod(folder.c_str(), is_fresh ? 0700 : status.st_mode & 07770u);
    }
    const fs::path probe = folder / ".write-test";
    const int fd = ::open(probe.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    if (fd < 0) {
      throw Error(ErrorCode::kFailedPrecondition,
                  "the data directory {} is not writable: {}; choose another --data-dir or change "
                  "its permissions",
                  folder.string(),
                  std::strerror(errno));
    }
    ::close(fd);
    ::unlink(probe.c_str());
  }
}

DataFolderLock::DataFolderLock(const DataPaths& paths) {
  fd_ = ::open(paths.Lock().c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (fd_ < 0) {
    throw Error(ErrorCode::kFailedPrecondition,
                "cannot open {}: {}",
                paths.Lock().string(),
                std::strerror(errno));
  }
  if (::flock(fd_, LOCK_EX | LOCK_NB) != 0) {
    ::close(fd_);
    throw Error(ErrorCode::kFailedPrecondition,
                "another server uses the data directory {}; stop it or choose another --data-dir",
                paths.root.string());
  }
}

DataFolderLock::~DataFolderLock() { ::close(fd_); }

}  // namespace color3d
