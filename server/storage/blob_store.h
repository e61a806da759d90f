// Content-addressed bytes: what is stored under a SHA-256 digest never changes. Thread-safe;
// several processes may share a store.
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

namespace color3d {

// Disk space that is promised to something that is still being written. Given back when it is
// destroyed. Not thread-safe.
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

  // So many bytes are on the disk now.
  void Use(int64_t bytes) {
    const int64_t used = std::min(bytes, bytes_);
    if (total_) *total_ -= used;
    bytes_ -= used;
  }

 private:
  std::shared_ptr<std::atomic<int64_t>> total_;
  int64_t bytes_ = 0;
};

struct StoredBlob {
  FileDigest digest;
  int64_t touched_ns = 0;  // changes with every Put and Touch; only equality means something
};

class BlobStore {
 public:
  virtual ~BlobStore() = default;

  // Whether the blob is there with this size; also says that somebody counts on it
  // (RemoveIfUntouched). As all that look for a blob it throws Error{kUnavailable, BLOB_UNREADABLE}
  // where the disk does not say whether it is there.
  virtual bool Touch(const FileDigest& digest) const = 0;
  // The blob as it is, without touching it; nothing where it is not there.
  virtual std::optional<StoredBlob> Look(const std::string& sha256) const = 0;
  // Path of a read-only file. Throws Error{kNotFound, BLOB_MISSING}.
  virtual std::filesystem::path Fetch(const std::string& sha256) const = 0;
  // Good bytes take the place of damaged ones.
  virtual FileDigest PutBytes(std::string_view bytes) = 0;
  // Moves the file in (same filesystem; the original is gone afterwards).
  virtual FileDigest PutFile(const std::filesystem::path& file) = 0;
  // As PutFile, for a file whose digest the caller has just computed.
  virtual void Adopt(const std::filesystem::path& file, const FileDigest& digest) = 0;
  virtual void Remove(const std::string& sha256) = 0;
  // Reads the blob again, and sets it aside where its bytes are not those of its digest: it is
  // missing from then on, so that an upload puts good bytes in its place. False where the bytes are
  // good, as when somebody has put good ones there since they were found damaged.
  virtual bool SetAside(const std::string& sha256) = 0;
  // Blobs that were found damaged, by whomever in this process.
  virtual int64_t damaged() const = 0;

  // Throws Error{kResourceExhausted, STORAGE_FULL} when `bytes` more would not leave the reserve.
  virtual void RequireSpace(int64_t bytes) const = 0;
  // The same, and keeps them from others of this process until they are used.
  virtual SpaceReservation Reserve(int64_t bytes) = 0;
  // Less what is reserved; not below 0, though more may be promised than there is.
  virtual int64_t FreeBytes() const = 0;

  // Every blob, until `visit` returns false. Returns what could not be looked at, "PATH: REASON":
  // whether there are blobs is not known.
  virtual std::vector<std::string> ForEach(
      const std::function<bool(const StoredBlob&)>& visit) const = 0;
  // False when it was touched since, when it is gone, or when somebody uses the store just now.
  virtual bool RemoveIfUntouched(const StoredBlob& blob) = 0;
  // Files that a crash left half-written, and what was set aside, older than `age` at this
  // call and at the last one; how many.
  virtual int RemoveLeftovers(std::chrono::seconds age) = 0;
};

struct ListedBlobs {
  std::vector<StoredBlob> blobs;
  std::vector<std::string> unreadable;  // as BlobStore::ForEach
};

// All of them, or those that were found until `stop` said so.
ListedBlobs ListBlobs(const BlobStore& blobs, const std::function<bool()>& stop);

// Whether the bytes are those of the digest; not, where the disk does not give them. Throws
// Error{kNotFound, BLOB_MISSING}; kFailedPrecondition where they may not be read.
bool IsIntact(const BlobStore& blobs, const FileDigest& digest);

}  // namespace color3d
