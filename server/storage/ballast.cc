#include "server/storage/ballast.h"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <system_error>
#include <utility>

namespace color3d {
namespace fs = std::filesystem;

Ballast::Ballast(fs::path file, int64_t bytes) : file_(std::move(file)), bytes_(bytes) {}

bool Ballast::IsThere() const {
  const MutexLock lock(mutex_);
  std::error_code error;
  return static_cast<int64_t>(fs::file_size(file_, error)) >= bytes_ && !error;
}

bool Ballast::Make() {
  if (bytes_ <= 0 || IsThere()) return bytes_ > 0;
  const MutexLock lock(mutex_);
  const int fd = ::open(file_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  if (fd < 0) return false;
  const bool made = ::posix_fallocate(fd, 0, bytes_) == 0;
  ::close(fd);
  if (!made) ::unlink(file_.c_str());
  return made;
}

bool Ballast::Release() {
  const MutexLock lock(mutex_);
  if (::unlink(file_.c_str()) != 0) return false;
  spdlog::warn(
      "the disk is full: the {} MiB of {} are given up, so that jobs and scenes can be "
      "deleted",
      bytes_ >> 20,
      file_.string());
  return true;
}

int64_t BallastBytes(const fs::path& folder) {
  std::error_code error;
  const fs::space_info space = fs::space(folder, error);
  if (error) return 0;
  return std::min<int64_t>(int64_t{16} << 20, static_cast<int64_t>(space.capacity / 20));
}

}  // namespace color3d
