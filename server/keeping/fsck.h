// Checks and repairs a data folder.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "server/storage/blob_store.h"

namespace color3d {

struct FsckResult {
  std::vector<std::string> store_problems;    // as reported by SQLite
  std::vector<std::string> missing, damaged;  // digests of blobs referenced by jobs or scenes
  // "PATH: REASON" or "DIGEST: REASON" of folders and blobs that cannot be read.
  std::vector<std::string> unreadable;
  int64_t awaited = 0;  // not uploaded yet, of uncommitted scenes
  int64_t damaged_unnamed = 0;
  int64_t blobs = 0;
  int64_t bytes = 0;
  int64_t unnamed = 0;  // unreferenced blobs; collected later by the server

  bool IsGood() const {
    return store_problems.empty() && missing.empty() && damaged.empty() && unreadable.empty();
  }
};

// Verifies the whole folder, or the blobs in `elsewhere` in place of those in the folder, with the
// references of the PostgreSQL store at `address`, or of jobs.db if that is empty. Throws
// kFailedPrecondition if a server uses the folder. `repair`: sets damaged blobs aside, so that an
// upload or another run replaces them. Calls `progress` with the number of blobs read so far.
FsckResult Fsck(const std::filesystem::path& data_folder,
                const std::string& address,
                BlobStore* elsewhere,
                bool repair,
                const std::function<void(int64_t blobs)>& progress);

}  // namespace color3d
