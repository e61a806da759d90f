// Part of the blob store that workers call: on the server's disk, or over the network. Thread-safe.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/digest.h"

namespace color3d {

struct StoredBlob {
  FileDigest digest;
  int64_t touched_ns = 0;  // changes with each Put and Touch; compare for equality only
};

class WorkerBlobs {
 public:
  virtual ~WorkerBlobs() = default;

  // Returns true if the blob is stored with this size, and marks it as used (RemoveIfUntouched).
  // Like all lookups, throws Error{kUnavailable, BLOB_UNREADABLE} if the disk cannot tell.
  virtual bool Touch(const FileDigest& digest) const = 0;
  // Returns the blob without touching it, or nothing if it is not stored.
  virtual std::optional<StoredBlob> Look(const std::string& sha256) const = 0;
  // Calls `use` with the path of a read-only file that has these bytes, and keeps the file until
  // `use` returns; a hard link to it stays valid. Throws Error{kNotFound, BLOB_MISSING}.
  virtual void Borrow(const std::string& sha256,
                      const std::function<void(const std::filesystem::path&)>& use) const = 0;
  // Replaces a damaged blob.
  virtual FileDigest PutBytes(std::string_view bytes) = 0;
  // Moves the file into the store. Requires: same filesystem.
  virtual FileDigest PutFile(const std::filesystem::path& file) = 0;
  // Like PutFile, for a file whose digest the caller has just computed.
  virtual void Adopt(const std::filesystem::path& file, const FileDigest& digest) = 0;
  // Throws Error{kResourceExhausted, STORAGE_FULL} if `bytes` more would not leave the reserve.
  virtual void RequireSpace(int64_t bytes) const = 0;
  // Returns false if the blob was touched since, does not exist, or the store is in use.
  virtual bool RemoveIfUntouched(const StoredBlob& blob) = 0;
};

}  // namespace color3d
