#include "server/storage/blob_store.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <ctime>

#include "core/base/files.h"
#include "server/service_error.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

// Keeps the sweep from removing a blob between another process's look and its use of it.
class FolderLock {
 public:
  FolderLock(const fs::path& folder, int operation) {
    fd_ = ::open((folder / ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    if (fd_ >= 0) ::flock(fd_, operation);
  }
  ~FolderLock() {
    if (fd_ >= 0) ::close(fd_);
  }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int fd_;
};

}  // namespace

BlobStore::BlobStore(const fs::path& folder, BlobStoreOptions options)
    : folder_(folder), options_(options) {
  std::error_code error;
  fs::create_directories(folder_, error);
}

fs::path BlobStore::PathOf(const std::string& sha256) const {
  if (!IsSha256Hex(sha256)) {
    throw InvalidArgument("'{}' is not a SHA-256 digest: 64 lower-case hexadecimal digits",
                          sha256.substr(0, 80));
  }
  return folder_ / sha256.substr(0, 2) / sha256.substr(2, 2) / sha256;
}

bool BlobStore::Touch(const FileDigest& digest) const {
  const fs::path path = PathOf(digest.sha256);
  FolderLock lock(folder_, LOCK_SH);
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0 || status.st_size != digest.size_bytes) return false;
  // Once an hour is enough for a grace period of a day.
  if (::time(nullptr) - status.st_mtime > 3600) ::utimensat(AT_FDCWD, path.c_str(), nullptr, 0);
  return true;
}

fs::path BlobStore::Fetch(const std::string& sha256) const {
  const fs::path path = PathOf(sha256);
  std::error_code error;
  if (!fs::is_regular_file(path, error)) {
    throw ServiceError(
        ErrorCode::kNotFound, "BLOB_MISSING", "the blob {} is not stored; upload it", sha256);
  }
  return path;
}

int64_t BlobStore::FreeBytes() const {
  struct statvfs status {};
  if (::statvfs(folder_.c_str(), &status) != 0) return 0;
  return static_cast<int64_t>(status.f_bavail) * static_cast<int64_t>(status.f_frsize);
}

void BlobStore::RequireSpace(int64_t bytes) const {
  const int64_t free = FreeBytes();
  if (free - bytes < options_.reserve_bytes) {
    throw ServiceError(
        ErrorCode::kResourceExhausted,
        "STORAGE_FULL",
        "{} more bytes do not fit: {} are free on the server's disk, of which {} are "
        "kept in reserve; delete jobs or scenes, or add disk space",
        bytes,
        free,
        options_.reserve_bytes);
  }
}

void BlobStore::Adopt(const fs::path& file, const FileDigest& digest) {
  const fs::path path = PathOf(digest.sha256);
  if (Touch(digest)) {
    ::unlink(file.c_str());
    return;
  }
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  ::chmod(file.c_str(), 0444);
  FolderLock lock(folder_, LOCK_SH);
  PublishFile(file, path);
  ::utimensat(AT_FDCWD, path.c_str(), nullptr, 0);
}

FileDigest BlobStore::PutBytes(std::string_view bytes) {
  const FileDigest digest{Sha256Hex(bytes), static_cast<int64_t>(bytes.size())};
  if (Touch(digest)) return digest;
  RequireSpace(digest.size_bytes);
  const fs::path path = PathOf(digest.sha256);
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  try {
    WriteFileAtomic(path, bytes);
  } catch (const Error& e) {
    if (e.code() == ErrorCode::kResourceExhausted) {
      throw ServiceError(e.code(), "STORAGE_FULL", e.what());
    }
    throw;
  }
  ::chmod(path.c_str(), 0444);
  return digest;
}

FileDigest BlobStore::PutFile(const fs::path& file) {
  const FileDigest digest = DigestFile(file);
  Adopt(file, digest);
  return digest;
}

void BlobStore::Remove(const std::string& sha256) { ::unlink(PathOf(sha256).c_str()); }

BlobStore::Sweep BlobStore::RemoveUnreferenced(const std::set<std::string>& referenced,
                                               std::chrono::seconds grace) {
  Sweep sweep;
  std::error_code error;
  const std::time_t oldest = ::time(nullptr) - grace.count();
  for (fs::recursive_directory_iterator it(folder_, error), end; it != end; it.increment(error)) {
    if (error) break;
    const std::string name = it->path().filename().string();
    if (!it->is_regular_file(error) || name == ".lock" || referenced.count(name) > 0) continue;
    FolderLock lock(folder_, LOCK_EX);
    struct stat status {};
    if (::stat(it->path().c_str(), &status) != 0 || status.st_mtime > oldest) continue;
    if (::unlink(it->path().c_str()) != 0) continue;
    ++sweep.removed;
    sweep.bytes += status.st_size;
  }
  return sweep;
}

}  // namespace color3d
