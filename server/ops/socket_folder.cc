#include "server/ops/socket_folder.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/base/error.h"

namespace color3d {
namespace fs = std::filesystem;

SocketFolder::SocketFolder(const fs::path& folder) : folder_(folder) {
  const auto fail = [&](const std::string& why) {
    return Error(ErrorCode::kFailedPrecondition,
                 "cannot use the socket folder {}: {}; remove it, or choose another --data-dir",
                 folder_.string(),
                 why);
  };
  if (::mkdir(folder_.c_str(), 0700) != 0 && errno != EEXIST) throw fail(std::strerror(errno));
  fd_ = ::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (fd_ < 0) throw fail(std::strerror(errno));
  struct stat status {};
  const bool known = ::fstat(fd_, &status) == 0;
  if (known && status.st_uid == ::geteuid() && ::fchmod(fd_, 0700) == 0) return;
  ::close(fd_);
  throw fail("it belongs to another user");
}

SocketFolder::~SocketFolder() { ::close(fd_); }

std::string SocketFolder::Address(const std::string& name) const {
  return "unix:/proc/self/fd/" + std::to_string(fd_) + "/" + name;
}

void SocketFolder::RemoveAll() const {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder_, error)) {
    std::error_code ignored;
    if (entry.is_socket(ignored)) fs::remove(entry.path(), ignored);
  }
}

}  // namespace color3d
