#include "server/storage/s3/local_files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "server/base/service_error.h"

namespace color3d {
namespace fs = std::filesystem;

OpenBlob::OpenBlob(const fs::path& file) : file_(file) {
  fd_ = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd_ < 0) Throw();
}

OpenBlob::~OpenBlob() { ::close(fd_); }

size_t OpenBlob::Read(int64_t offset, char* buffer, size_t size) const {
  while (true) {
    const ssize_t got = ::pread(fd_, buffer, size, offset);
    if (got > 0) return static_cast<size_t>(got);
    if (got == 0) {
      throw Error(ErrorCode::kDataLoss, "{} became shorter while it was stored", file_.string());
    }
    if (errno != EINTR) Throw();
  }
}

void OpenBlob::Throw() const {
  throw Error(ErrorCode::kDataLoss, "cannot read {}: {}", file_.string(), std::strerror(errno));
}

GrowingFile::GrowingFile(const fs::path& file) : file_(file) {
  fd_ = ::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  if (fd_ < 0) Throw();
  struct stat status {};
  if (::fstat(fd_, &status) == 0) size_ = status.st_size;
}

GrowingFile::~GrowingFile() { ::close(fd_); }

void GrowingFile::Append(std::string_view data) {
  while (!data.empty()) {
    const ssize_t put = ::write(fd_, data.data(), data.size());
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) Throw();
    data.remove_prefix(static_cast<size_t>(put));
    size_ += put;
  }
}

void GrowingFile::Throw() const {
  if (errno == ENOSPC || errno == EDQUOT) {
    throw ServiceError(ErrorReason::kStorageFull,
                       "cannot write {}: the server's disk is full; free some space, or give a "
                       "smaller --blob-cache-gib",
                       file_.string());
  }
  throw Error(ErrorCode::kUnavailable, "cannot write {}: {}", file_.string(), std::strerror(errno));
}

}  // namespace color3d
