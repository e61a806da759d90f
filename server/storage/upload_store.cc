#include "server/storage/upload_store.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <ctime>

#include "core/base/folder_walk.h"
#include "server/base/service_error.h"

namespace color3d {
namespace fs = std::filesystem;

struct UploadStore::Writer::Session {
  Mutex mutex;
  uint64_t generation COLOR3D_GUARDED_BY(mutex) = 0;

  // Throws UPLOAD_TAKEN_OVER unless the writer of this generation is the newest.
  void RequireOwner(uint64_t writer) const COLOR3D_REQUIRES(mutex) {
    if (writer == generation) return;
    throw ServiceError(ErrorReason::kUploadTakenOver,
                       "another connection has resumed this upload; call QueryWriteStatus");
  }
};

namespace {

// Maximum number of unfinished uploads of an owner: each is a file.
constexpr size_t kMaxUnfinished = 1'000;

void CheckName(const UploadName& name, int64_t max_blob_bytes) {
  constexpr char kAllowed[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-";
  if (name.uuid.empty() || name.uuid.size() > 64 ||
      name.uuid.find_first_not_of(kAllowed) != std::string::npos) {
    throw InvalidArgument("the upload id '{}' must be 1 to 64 letters, digits or '-'",
                          name.uuid.substr(0, 80));
  }
  if (!IsSha256Hex(name.digest.sha256)) {
    throw InvalidArgument("'{}' is not a SHA-256 digest: 64 lower-case hexadecimal digits",
                          name.digest.sha256.substr(0, 80));
  }
  if (name.digest.size_bytes < 0 || name.digest.size_bytes > max_blob_bytes) {
    throw InvalidArgument(
        "a blob of {} bytes: 0 to {} are allowed", name.digest.size_bytes, max_blob_bytes);
  }
}

// Owner of a file named by PartPath.
std::string OwnerOf(const std::string& part) {
  const std::string before = part.substr(0, part.find('.'));
  const size_t at = before.find('@');
  return at == std::string::npos ? "" : before.substr(at + 1);
}

[[noreturn]] void ThrowWriteError(const std::string& what) {
  const int error = errno;
  if (error == ENOSPC || error == EDQUOT) {
    throw ServiceError(ErrorReason::kStorageFull,
                       "{}: the server's disk is full; the received bytes are kept: resume later",
                       what);
  }
  throw Error(ErrorCode::kInternal, "{}: {}", what, std::strerror(error));
}

}  // namespace

UploadStore::UploadStore(const fs::path& folder, BlobStore& blobs, int64_t max_blob_bytes)
    : folder_(folder), blobs_(blobs), max_blob_bytes_(max_blob_bytes) {
  std::error_code error;
  fs::create_directories(folder_, error);
  const auto unreadable =
      WalkFolder(folder_, WalkDepth::kFolder, [&](const fs::directory_entry& entry) {
        const MutexLock lock(mutex_);
        CountOnDisk(entry.path().filename().string());
        return true;
      });
  if (!unreadable.empty()) {
    throw Error(ErrorCode::kFailedPrecondition,
                "cannot read the unfinished uploads of {}; change the folder's permissions",
                unreadable.front());
  }
}

void UploadStore::CountOnDisk(const std::string& part) {
  const std::string owner = OwnerOf(part);
  std::error_code error;
  const auto size = static_cast<int64_t>(fs::file_size(folder_ / part, error));
  if (!error) {
    bytes_[owner][part] = size;
  } else if (bytes_[owner].erase(part) > 0 && bytes_[owner].empty()) {
    bytes_.erase(owner);
  }
}

fs::path UploadStore::PartPath(const UploadName& name) const {
  return folder_ / (name.uuid + (name.owner.empty() ? "" : "@") + name.owner + "." +
                    name.digest.sha256 + "." + std::to_string(name.digest.size_bytes) + ".part");
}

int64_t UploadStore::CommittedSize(const UploadName& name) {
  CheckName(name, max_blob_bytes_);
  const int fd = ::open(PartPath(name).c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return 0;
  struct stat status {};
  const bool known = ::fsync(fd) == 0 && ::fstat(fd, &status) == 0;
  ::close(fd);
  return known ? static_cast<int64_t>(status.st_size) : 0;
}

std::unique_ptr<UploadStore::Writer> UploadStore::Open(const UploadName& name,
                                                       int64_t offset,
                                                       const Admission& admit) {
  CheckName(name, max_blob_bytes_);
  const fs::path path = PartPath(name);
  std::unique_ptr<Writer> writer;
  {
    const std::string part = path.filename().string();
    const MutexLock lock(mutex_);
    std::map<std::string, int64_t>& owned = bytes_[name.owner];
    int64_t others = 0;
    for (const auto& [other, bytes] : owned) others += other == part ? 0 : bytes;
    if (!owned.contains(part) && owned.size() >= kMaxUnfinished) {
      throw ServiceError(
          ErrorReason::kQuotaExceeded,
          fmt::format("your project has {} unfinished uploads, the maximum; finish some, or "
                      "wait a day until they are removed",
                      owned.size()),
          {{"project:" + name.owner + " unfinished uploads",
            fmt::format("{} of {}", owned.size(), kMaxUnfinished)}});
    }
    admit(others + name.digest.size_bytes);
    owned[part] = name.digest.size_bytes;
    writer.reset(new Writer());
    writer->store_ = this;
    writer->name_ = name;
    std::weak_ptr<Writer::Session>& entry = sessions_[part];
    writer->session_ = entry.lock();
    if (!writer->session_) {
      writer->session_ = std::make_shared<Writer::Session>();
      entry = writer->session_;
    }
  }
  const MutexLock lock(writer->session_->mutex);
  writer->fd_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  struct stat status {};
  if (writer->fd_ < 0 || ::fstat(writer->fd_, &status) != 0)
    ThrowWriteError("cannot open an upload");
  writer->size_ = status.st_size;
  if (offset != writer->size_) {
    throw ServiceError(ErrorReason::kOffsetMismatch,
                       "the upload has {} bytes, the write starts at {}; call QueryWriteStatus "
                       "and continue from there",
                       writer->size_,
                       offset);
  }
  writer->space_ = blobs_.Reserve(name.digest.size_bytes - writer->size_);
  writer->generation_ = ++writer->session_->generation;
  return writer;
}

UploadStore::Writer::~Writer() {
  if (fd_ >= 0) {
    ::fsync(fd_);
    ::close(fd_);
  }
  const std::string key = store_->PartPath(name_).filename().string();
  const MutexLock lock(store_->mutex_);
  session_.reset();
  const auto entry = store_->sessions_.find(key);
  if (entry == store_->sessions_.end() || !entry->second.expired()) return;
  store_->sessions_.erase(entry);
  // Nothing was written, so nothing can be resumed.
  std::error_code error;
  if (fs::file_size(store_->folder_ / key, error) == 0 && !error) {
    fs::remove(store_->folder_ / key, error);
  }
  store_->CountOnDisk(key);
}

void UploadStore::Writer::Append(int64_t offset, std::string_view data) {
  const MutexLock lock(session_->mutex);
  session_->RequireOwner(generation_);
  if (offset != size_) {
    throw ServiceError(ErrorReason::kOffsetMismatch,
                       "a write at offset {} follows one that ended at {}",
                       offset,
                       size_);
  }
  if (size_ + static_cast<int64_t>(data.size()) > name_.digest.size_bytes) {
    throw ServiceError(
        ErrorReason::kSizeMismatch, "more bytes than the announced {}", name_.digest.size_bytes);
  }
  while (!data.empty()) {
    const ssize_t put = ::write(fd_, data.data(), data.size());
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) ThrowWriteError("cannot write an upload");
    data.remove_prefix(static_cast<size_t>(put));
    size_ += put;
    space_.Use(put);
  }
}

int64_t UploadStore::Writer::Sync() {
  const MutexLock lock(session_->mutex);
  session_->RequireOwner(generation_);
  if (::fsync(fd_) != 0) ThrowWriteError("cannot sync an upload");
  return size_;
}

void UploadStore::Writer::Finish() {
  const MutexLock lock(session_->mutex);
  session_->RequireOwner(generation_);
  if (size_ != name_.digest.size_bytes) {
    throw ServiceError(ErrorReason::kSizeMismatch,
                       "the upload ends after {} of the announced {} bytes",
                       size_,
                       name_.digest.size_bytes);
  }
  const fs::path path = store_->PartPath(name_);
  const FileDigest actual = DigestFile(path);
  if (actual.sha256 != name_.digest.sha256) {
    ::unlink(path.c_str());
    throw ServiceError(ErrorReason::kDigestMismatch,
                       "the bytes have the digest {}, announced was {}; upload the file again",
                       actual.sha256,
                       name_.digest.sha256);
  }
  store_->blobs_.Adopt(path, actual);
}

UploadStore::Reaped UploadStore::ReapOlderThan(std::chrono::seconds age) {
  Reaped reaped;
  stale_.Look(age);
  reaped.unreadable =
      WalkFolder(folder_, WalkDepth::kFolder, [&](const fs::directory_entry& entry) {
        if (!stale_.IsStale(entry.path())) return true;
        const std::string part = entry.path().filename().string();
        const MutexLock lock(mutex_);
        if (sessions_.contains(part)) return true;
        if (::unlink(entry.path().c_str()) == 0) ++reaped.uploads;
        CountOnDisk(part);
        return true;
      });
  return reaped;
}

}  // namespace color3d
