// Immutable bytes by SHA-256 digest. Thread-safe; several processes may share a store.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/digest.h"
#include "server/storage/worker_blobs.h"

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

class BlobStore : public WorkerBlobs {
 public:
  // Returns the path of a read-only file. Throws Error{kNotFound, BLOB_MISSING}.
  virtual std::filesystem::path Fetch(const std::string& sha256) const = 0;
  void Borrow(const std::string& sha256,
              const std::function<void(const std::filesystem::path&)>& use) const override {
    use(Fetch(sha256));
  }
  virtual void Remove(const std::string& sha256) = 0;
  // Rereads the blob and sets it aside if its digest is wrong; it is then missing, so that an
  // upload can replace it. Returns false if the bytes are good, e.g. replaced since they were found
  // damaged.
  virtual bool SetAside(const std::string& sha256) = 0;
  // Number of damaged blobs found by this process.
  virtual int64_t damaged() const = 0;

  // As RequireSpace, and reserves the space within this process.
  virtual SpaceReservation Reserve(int64_t bytes) = 0;
  // Free space minus reservations, at least 0; reservations may exceed the free space.
  virtual int64_t FreeBytes() const = 0;

  // Visits all blobs until `visit` returns false. Returns unreadable paths as "PATH: REASON", which
  // may contain further blobs.
  virtual std::vector<std::string> ForEach(
      const std::function<bool(const StoredBlob&)>& visit) const = 0;
  // Removes partial files of crashes and blobs set aside that were older than `age` at this and the
  // last call. Returns their number.
  virtual int RemoveLeftovers(std::chrono::seconds age) = 0;
};

struct ListedBlobs {
  std::vector<StoredBlob> blobs;
  std::vector<std::string> unreadable;  // see BlobStore::ForEach
};

// Lists all blobs, or those found until `stop` returns true.
ListedBlobs ListBlobs(const BlobStore& blobs, const std::function<bool()>& stop);

// Returns true if the bytes match the digest, false also on read errors. Throws Error{kNotFound,
// BLOB_MISSING}, or kFailedPrecondition without permission to read.
bool IsIntact(const BlobStore& blobs, const FileDigest& digest);

}  // namespace color3d
