// Free space of the disk of a folder, less what is reserved for files that are being written, and
// less a reserve that stays free. Thread-safe.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <utility>

namespace color3d {

// Disk space reserved for a file that is being written; released by the destructor. Not
// thread-safe.
class SpaceReservation {
 public:
  SpaceReservation() = default;
  SpaceReservation(std::shared_ptr<std::atomic<int64_t>> total, int64_t bytes)
      : total_(std::move(total)), bytes_(bytes) {}
  ~SpaceReservation() { Use(bytes_); }
  SpaceReservation(SpaceReservation&& other) noexcept
      : total_(std::move(other.total_)), bytes_(std::exchange(other.bytes_, 0)) {}
  SpaceReservation& operator=(SpaceReservation&& other) noexcept {
    std::swap(total_, other.total_);
    std::swap(bytes_, other.bytes_);
    return *this;
  }

  // Reduces the reservation by bytes that are now on disk.
  void Use(int64_t bytes) {
    const int64_t used = std::min(bytes, bytes_);
    if (total_) *total_ -= used;
    bytes_ -= used;
  }

 private:
  std::shared_ptr<std::atomic<int64_t>> total_;
  int64_t bytes_ = 0;
};

class DiskSpace {
 public:
  // `reserve_bytes`: as BlobStoreOptions.
  DiskSpace(std::filesystem::path folder, int64_t reserve_bytes)
      : folder_(std::move(folder)), reserve_bytes_(reserve_bytes) {}

  // Throws Error{kResourceExhausted, STORAGE_FULL} if `bytes` more would not leave the reserve.
  void Require(int64_t bytes) const;
  // As Require, and reserves the space within this process.
  SpaceReservation Reserve(int64_t bytes);
  // Free space minus reservations, at least 0; reservations may exceed the free space.
  int64_t FreeBytes() const { return std::max<int64_t>(0, UnpromisedBytes()); }

 private:
  int64_t UnpromisedBytes() const;  // below 0 if more is reserved than free
  [[noreturn]] void ThrowFull(int64_t bytes, int64_t free) const;

  const std::filesystem::path folder_;
  const int64_t reserve_bytes_;
  const std::shared_ptr<std::atomic<int64_t>> reserved_ = std::make_shared<std::atomic<int64_t>>(0);
};

}  // namespace color3d
