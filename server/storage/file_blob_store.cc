#include "server/storage/file_blob_store.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>

#include "core/base/files.h"
#include "server/service_error.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr char kSetAside[] = ".damaged";

// Keeps the sweep from removing a blob between another process's look and its use of it.
class FolderLock {
 public:
  FolderLock(const fs::path& folder, int operation) {
    fd_ = ::open((folder / ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    held_ = fd_ >= 0 && ::flock(fd_, operation) == 0;
  }
  ~FolderLock() {
    if (fd_ >= 0) ::close(fd_);
  }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;
  bool held() const { return held_; }

 private:
  int fd_;
  bool held_ = false;
};

int64_t TouchedNs(const struct stat& status) {
  return static_cast<int64_t>(status.st_mtim.tv_sec) * 1'000'000'000 + status.st_mtim.tv_nsec;
}

}  // namespace

FileBlobStore::FileBlobStore(const fs::path& folder, BlobStoreOptions options)
    : folder_(folder), options_(options) {
  std::error_code error;
  fs::create_directories(folder_, error);
}

fs::path FileBlobStore::PathOf(const std::string& sha256) const {
  if (!IsSha256Hex(sha256)) {
    throw InvalidArgument("'{}' is not a SHA-256 digest: 64 lower-case hexadecimal digits",
                          sha256.substr(0, 80));
  }
  return folder_ / sha256.substr(0, 2) / sha256.substr(2, 2) / sha256;
}

bool FileBlobStore::Touch(const FileDigest& digest) const {
  const fs::path path = PathOf(digest.sha256);
  FolderLock lock(folder_, LOCK_SH);
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0 || status.st_size != digest.size_bytes) return false;
  ::utimensat(AT_FDCWD, path.c_str(), nullptr, 0);
  return true;
}

fs::path FileBlobStore::Fetch(const std::string& sha256) const {
  const fs::path path = PathOf(sha256);
  std::error_code error;
  if (!fs::is_regular_file(path, error)) {
    throw ServiceError(
        ErrorCode::kNotFound, "BLOB_MISSING", "the blob {} is not stored; upload it", sha256);
  }
  return path;
}

fs::path FileBlobStore::PlaceFor(const std::string& sha256) const {
  const fs::path path = PathOf(sha256);
  for (const fs::path& level : {path.parent_path().parent_path(), path.parent_path()}) {
    std::error_code error;
    if (fs::create_directory(level, error)) SyncFolder(level.parent_path());
  }
  return path;
}

int64_t FileBlobStore::FreeBytes() const { return std::max<int64_t>(0, UnpromisedBytes()); }

int64_t FileBlobStore::UnpromisedBytes() const {
  struct statvfs status {};
  if (::statvfs(folder_.c_str(), &status) != 0) return 0;
  return static_cast<int64_t>(status.f_bavail) * static_cast<int64_t>(status.f_frsize) -
         reserved_->load();
}

SpaceReservation FileBlobStore::Reserve(int64_t bytes) {
  *reserved_ += bytes;
  SpaceReservation reservation(reserved_, bytes);
  const int64_t left = UnpromisedBytes();
  if (left < options_.reserve_bytes) ThrowFull(bytes, left + bytes);
  return reservation;
}

void FileBlobStore::RequireSpace(int64_t bytes) const {
  const int64_t free = UnpromisedBytes();
  if (free - bytes < options_.reserve_bytes) ThrowFull(bytes, free);
}

void FileBlobStore::ThrowFull(int64_t bytes, int64_t free) const {
  std::error_code error;
  if (!fs::exists(folder_, error)) {
    throw Error(ErrorCode::kUnavailable,
                "the folder {} is gone; is its disk still there?",
                folder_.string());
  }
  throw ServiceError(ErrorCode::kResourceExhausted,
                     "STORAGE_FULL",
                     "{} more bytes do not fit: {} are free on the server's disk and promised to "
                     "nobody, of which {} are kept in reserve; delete jobs or scenes, or add disk "
                     "space",
                     bytes,
                     free,
                     options_.reserve_bytes);
}

void FileBlobStore::Adopt(const fs::path& file, const FileDigest& digest) {
  if (Touch(digest) && IsIntact(*this, digest)) {
    ::unlink(file.c_str());
    return;
  }
  const fs::path path = PlaceFor(digest.sha256);
  ::chmod(file.c_str(), 0444);
  FolderLock lock(folder_, LOCK_SH);
  PublishFile(file, path);
  ::utimensat(AT_FDCWD, path.c_str(), nullptr, 0);
}

FileDigest FileBlobStore::PutBytes(std::string_view bytes) {
  const FileDigest digest{Sha256Hex(bytes), static_cast<int64_t>(bytes.size())};
  if (Touch(digest) && IsIntact(*this, digest)) return digest;
  RequireSpace(digest.size_bytes);
  const fs::path path = PlaceFor(digest.sha256);
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

FileDigest FileBlobStore::PutFile(const fs::path& file) {
  const FileDigest digest = DigestFile(file);
  Adopt(file, digest);
  return digest;
}

void FileBlobStore::Remove(const std::string& sha256) { ::unlink(PathOf(sha256).c_str()); }

void FileBlobStore::SetAside(const std::string& sha256) {
  const fs::path path = PathOf(sha256);
  ::rename(path.c_str(), (path.string() + kSetAside).c_str());
}

void FileBlobStore::ForEach(const std::function<bool(const StoredBlob&)>& visit) const {
  std::error_code error;
  for (fs::recursive_directory_iterator it(folder_, error), end; it != end; it.increment(error)) {
    if (error) break;
    const std::string name = it->path().filename().string();
    struct stat status {};
    if (!IsSha256Hex(name) || ::stat(it->path().c_str(), &status) != 0) continue;
    if (!S_ISREG(status.st_mode)) continue;
    if (!visit({{name, static_cast<int64_t>(status.st_size)}, TouchedNs(status)})) return;
  }
}

bool FileBlobStore::RemoveIfUntouched(const StoredBlob& blob) {
  const fs::path path = PathOf(blob.digest.sha256);
  const FolderLock lock(folder_, LOCK_EX | LOCK_NB);
  struct stat status {};
  if (!lock.held() || ::stat(path.c_str(), &status) != 0) return false;
  return TouchedNs(status) == blob.touched_ns && ::unlink(path.c_str()) == 0;
}

int FileBlobStore::RemoveLeftovers(std::chrono::seconds age) {
  int removed = 0;
  std::error_code error;
  stale_.Look(age);
  for (fs::recursive_directory_iterator it(folder_, error), end; it != end; it.increment(error)) {
    if (error) break;
    const std::string name = it->path().filename().string();
    if (!name.ends_with(".part") && !name.ends_with(kSetAside)) continue;
    if (!stale_.IsStale(it->path())) continue;
    if (::unlink(it->path().c_str()) == 0) ++removed;
  }
  return removed;
}

}  // namespace color3d
