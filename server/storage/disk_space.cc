#include "server/storage/disk_space.h"

#include <sys/statvfs.h>

#include <system_error>

#include "server/base/service_error.h"

namespace color3d {
namespace fs = std::filesystem;

int64_t DiskSpace::UnpromisedBytes() const {
  struct statvfs status {};
  if (::statvfs(folder_.c_str(), &status) != 0) return 0;
  return static_cast<int64_t>(status.f_bavail) * static_cast<int64_t>(status.f_frsize) -
         reserved_->load();
}

SpaceReservation DiskSpace::Reserve(int64_t bytes) {
  *reserved_ += bytes;
  SpaceReservation reservation(reserved_, bytes);
  const int64_t left = UnpromisedBytes();
  if (left < reserve_bytes_) ThrowFull(bytes, left + bytes);
  return reservation;
}

void DiskSpace::Require(int64_t bytes) const {
  const int64_t free = UnpromisedBytes();
  if (free - bytes < reserve_bytes_) ThrowFull(bytes, free);
}

void DiskSpace::ThrowFull(int64_t bytes, int64_t free) const {
  std::error_code error;
  if (!fs::exists(folder_, error)) {
    throw Error(ErrorCode::kUnavailable,
                "the folder {} does not exist; check that its disk is mounted",
                folder_.string());
  }
  throw ServiceError(
      ErrorReason::kStorageFull,
      "{} more bytes do not fit: {} are free and unreserved on the server's disk, of "
      "which {} must stay free; delete jobs or scenes, or add disk space",
      bytes,
      free,
      reserve_bytes_);
}

}  // namespace color3d
