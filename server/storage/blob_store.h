// Immutable bytes by SHA-256 digest. Thread-safe; several processes may share a store.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/digest.h"
#include "server/storage/disk_space.h"
#include "server/storage/worker_blobs.h"

namespace color3d {

class BlobStore : public WorkerBlobs {
 public:
  // As Touch, for many blobs: each by its place in the list.
  virtual std::vector<bool> TouchAll(const std::vector<FileDigest>& digests) const;
  // Rereads the blob where it is stored. Returns true if the bytes match the digest, false also if
  // the disk fails. Throws Error{kNotFound, BLOB_MISSING}, kFailedPrecondition without permission
  // to read, kUnavailable if the store cannot be reached.
  virtual bool IsIntact(const FileDigest& digest) const = 0;
  virtual void Remove(const std::string& sha256) = 0;
  // Rereads the blob and sets it aside if its digest is wrong; it is then missing, so that an
  // upload can replace it. Returns false if the bytes are good, e.g. replaced since they were found
  // damaged.
  virtual bool SetAside(const std::string& sha256) = 0;
  // Number of damaged blobs found by this process.
  virtual int64_t damaged() const = 0;

  // Space on the disk of the server, where uploads wait until they are whole (DiskSpace).
  virtual SpaceReservation Reserve(int64_t bytes) = 0;
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

inline bool IsIntact(const BlobStore& blobs, const FileDigest& digest) {
  return blobs.IsIntact(digest);
}

}  // namespace color3d
