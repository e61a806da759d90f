// Blobs on the disk of a worker: read-only files by SHA-256, at most a number of bytes in all. The
// files used longest ago are removed first; files in use are never removed: those being lent, and
// those with a hard link elsewhere, e.g. in the folder of a running job. Files of an earlier
// process are verified at their first use. Thread-safe; one process uses the folder.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>

#include "core/base/digest.h"
#include "core/base/mutex.h"

namespace color3d {

// Use of a cache, bytes.
struct CacheUse {
  int64_t bytes = 0;
  int64_t limit_bytes = 0;
  int64_t hit_bytes = 0;   // used, and present before
  int64_t miss_bytes = 0;  // used, and filled for it
};

class BlobCache {
 public:
  using Path = std::filesystem::path;

  // Creates the folder. Throws Error{kFailedPrecondition} if it cannot be read.
  BlobCache(const Path& folder, int64_t budget_bytes);

  // Calls `use` with the file of the blob. If there is none, first calls `fill(part)`, which must
  // write a file with this digest to `part`, where bytes of an earlier fill may lie; one call at a
  // time fills a blob, and others wait for it. Exceptions of both pass through.
  void Use(const std::string& sha256,
           const std::function<void(const Path& part)>& fill,
           const std::function<void(const Path& file)>& use);
  // Moves the file, whose digest the caller has computed, into the cache. Requires: same
  // filesystem.
  void Put(const Path& file, const FileDigest& digest);
  int64_t bytes() const;
  CacheUse use() const;

 private:
  struct Entry {
    int64_t bytes = 0;
    int64_t last_use = 0;  // counts uses
    int pins = 0;
    bool present = false;   // the file is there
    bool verified = false;  // by this process
    bool filling = false;
  };

  Path PathOf(const std::string& sha256) const { return folder_ / sha256; }
  void Pin(const std::string& sha256);
  void Unpin(const std::string& sha256);
  // Fills or verifies the blob unless that is done; returns whether it was filled. Requires: it is
  // pinned.
  bool MakeReady(const std::string& sha256, const std::function<void(const Path&)>& fill);
  void Accept(const std::string& sha256, const Path& file);
  // Removes files beyond the budget.
  void Trim() COLOR3D_REQUIRES(mutex_);

  const Path folder_;
  const int64_t budget_bytes_;
  mutable Mutex mutex_;
  CondVar filled_;
  std::map<std::string, Entry> entries_ COLOR3D_GUARDED_BY(mutex_);
  int64_t bytes_ COLOR3D_GUARDED_BY(mutex_) = 0;
  int64_t uses_ COLOR3D_GUARDED_BY(mutex_) = 0;
  int64_t hit_bytes_ COLOR3D_GUARDED_BY(mutex_) = 0;
  int64_t miss_bytes_ COLOR3D_GUARDED_BY(mutex_) = 0;
};

}  // namespace color3d
