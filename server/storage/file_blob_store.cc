#include "server/storage/file_blob_store.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "core/base/files.h"
#include "core/base/folder_walk.h"
#include "server/base/service_error.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr char kSetAside[] = ".damaged";

// Prevents the sweep from removing a blob between lookup and use by another process.
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

// Moves a file of another file system beside `place`, where it can be renamed. Returns its path.
fs::path OnSameDisk(const fs::path& file, const fs::path& place) {
  struct stat own {
  }, other{};
  if (::stat(file.c_str(), &own) != 0 || ::stat(place.parent_path().c_str(), &other) != 0 ||
      own.st_dev == other.st_dev) {
    return file;
  }
  // Unique over all machines that share the folder.
  std::random_device random;
  const fs::path beside = place.parent_path() / ("." + place.filename().string() + "." +
                                                 std::to_string(random()) + ".part");
  std::error_code error;
  if (!fs::copy_file(file, beside, error)) {
    fs::remove(beside);
    throw ServiceError(ErrorReason::kStorageFull,
                       "cannot copy a blob to {}: {}; free some disk space there",
                       place.parent_path().string(),
                       error.message());
  }
  fs::remove(file, error);
  return beside;
}

// Returns nothing if there is no such file. Throws if the disk cannot tell.
std::optional<struct stat> StatusOf(const fs::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0) return status;
  const int error = errno;
  if (error == ENOENT || error == ENOTDIR) return std::nullopt;
  throw ServiceError(
      ErrorReason::kBlobUnreadable,
      "cannot read the blob {}: {}; check its owner, permissions and disk on the server",
      path.filename().string(),
      std::strerror(error));
}

int64_t TouchedNs(const struct stat& status) {
  return static_cast<int64_t>(status.st_mtim.tv_sec) * 1'000'000'000 + status.st_mtim.tv_nsec;
}

// File times have a resolution of milliseconds: two touches could be equal.
void TouchFile(const fs::path& path, const struct stat& before) {
  timespec times[2] = {{0, UTIME_OMIT}, {}};
  ::clock_gettime(CLOCK_REALTIME, &times[1]);
  if (times[1].tv_sec == before.st_mtim.tv_sec && times[1].tv_nsec == before.st_mtim.tv_nsec) {
    times[1].tv_nsec += times[1].tv_nsec == 999'999'999 ? -1 : 1;
  }
  ::utimensat(AT_FDCWD, path.c_str(), times, 0);
}

// Digest of an open file; nothing on read errors.
std::optional<std::string> DigestOf(int fd) {
  Sha256 hash;
  std::vector<char> buffer(1 << 18);
  while (true) {
    const ssize_t got = ::read(fd, buffer.data(), buffer.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return std::nullopt;
    if (got == 0) return hash.FinishHex();
    hash.Update({buffer.data(), static_cast<size_t>(got)});
  }
}

}  // namespace

FileBlobStore::FileBlobStore(const fs::path& folder, BlobStoreOptions options)
    : folder_(folder), space_(folder, options.reserve_bytes) {
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
  const auto status = StatusOf(path);
  if (!status || status->st_size != digest.size_bytes) return false;
  TouchFile(path, *status);
  return true;
}

std::optional<StoredBlob> FileBlobStore::Look(const std::string& sha256) const {
  const auto status = StatusOf(PathOf(sha256));
  if (!status || !S_ISREG(status->st_mode)) return std::nullopt;
  return StoredBlob{{sha256, static_cast<int64_t>(status->st_size)}, TouchedNs(*status)};
}

fs::path FileBlobStore::Fetch(const std::string& sha256) const {
  const fs::path path = PathOf(sha256);
  if (const auto status = StatusOf(path); !status || !S_ISREG(status->st_mode)) {
    throw ServiceError(ErrorReason::kBlobMissing, "the blob {} is not stored; upload it", sha256);
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

bool FileBlobStore::IsIntact(const FileDigest& digest) const {
  try {
    const FileDigest actual = DigestFile(Fetch(digest.sha256));
    return actual.sha256 == digest.sha256 && actual.size_bytes == digest.size_bytes;
  } catch (const Error& e) {
    if (e.code() == ErrorCode::kDataLoss) return false;
    throw;
  }
}

bool FileBlobStore::IsThere(const FileDigest& digest) {
  if (!Touch(digest)) return false;
  if (IsIntact(digest)) return true;
  ++damaged_;
  return false;
}

void FileBlobStore::Adopt(const fs::path& file, const FileDigest& digest) {
  if (IsThere(digest)) {
    ::unlink(file.c_str());
    return;
  }
  const fs::path path = PlaceFor(digest.sha256);
  ::chmod(file.c_str(), 0444);
  const fs::path beside = OnSameDisk(file, path);
  FolderLock lock(folder_, LOCK_SH);
  PublishFile(beside, path);
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0) TouchFile(path, status);
}

FileDigest FileBlobStore::PutBytes(std::string_view bytes) {
  const FileDigest digest{Sha256Hex(bytes), static_cast<int64_t>(bytes.size())};
  if (IsThere(digest)) return digest;
  RequireSpace(digest.size_bytes);
  const fs::path path = PlaceFor(digest.sha256);
  try {
    WriteFileAtomic(path, bytes);
  } catch (const Error& e) {
    if (e.code() == ErrorCode::kResourceExhausted) {
      throw ServiceError(ErrorReason::kStorageFull, e.what());
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

bool FileBlobStore::SetAside(const std::string& sha256) {
  const fs::path path = PathOf(sha256);
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return false;
  const std::shared_ptr<void> closed(nullptr, [fd](void*) { ::close(fd); });
  if (DigestOf(fd) == sha256) return false;
  // A replacement is another file: the file that was read must be the one that is moved.
  struct stat read {};
  if (::fstat(fd, &read) != 0) return false;
  const auto is_read = [&](const fs::path& file) {
    struct stat status {};
    return ::stat(file.c_str(), &status) == 0 && status.st_ino == read.st_ino &&
           status.st_dev == read.st_dev;
  };
  const FolderLock lock(folder_, LOCK_EX);
  const fs::path aside = path.string() + kSetAside;
  if (!is_read(path) || ::rename(path.c_str(), aside.c_str()) != 0) return false;
  if (!is_read(aside)) {
    ::rename(aside.c_str(), path.c_str());
    return false;
  }
  ++damaged_;
  return true;
}

std::vector<std::string> FileBlobStore::ForEach(
    const std::function<bool(const StoredBlob&)>& visit) const {
  std::vector<std::string> unknown;
  std::vector<std::string> unreadable =
      WalkFolder(folder_, WalkDepth::kBelow, [&](const fs::directory_entry& entry) {
        const std::string name = entry.path().filename().string();
        if (!IsSha256Hex(name)) return true;
        try {
          const std::optional<StoredBlob> blob = Look(name);
          // Files of this name in other folders are not blobs.
          return !blob || entry.path() != PathOf(name) || visit(*blob);
        } catch (const Error& e) {
          unknown.push_back(entry.path().string() + ": " + e.what());
          return true;
        }
      });
  unreadable.insert(unreadable.end(), unknown.begin(), unknown.end());
  return unreadable;
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
  stale_.Look(age);
  // ForEach reports unreadable folders.
  WalkFolder(folder_, WalkDepth::kBelow, [&](const fs::directory_entry& entry) {
    const std::string name = entry.path().filename().string();
    const bool is_one = name.ends_with(".part") || name.ends_with(kSetAside);
    if (is_one && stale_.IsStale(entry.path()) && ::unlink(entry.path().c_str()) == 0) ++removed;
    return true;
  });
  return removed;
}

}  // namespace color3d
