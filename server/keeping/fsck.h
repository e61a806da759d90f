// Checks and repairs a data folder.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace color3d {

struct FsckResult {
  std::vector<std::string> store_problems;    // in SQLite's words
  std::vector<std::string> missing, damaged;  // digests of blobs that jobs or scenes name
  // "PATH: REASON" or "DIGEST: REASON": whether blobs are there and good is not known.
  std::vector<std::string> unreadable;
  int64_t awaited = 0;  // not uploaded yet, for scenes that are not committed
  int64_t damaged_unnamed = 0;
  int64_t blobs = 0;
  int64_t bytes = 0;
  int64_t unnamed = 0;  // blobs that nothing names; collected by the server in time

  bool IsGood() const {
    return store_problems.empty() && missing.empty() && damaged.empty() && unreadable.empty();
  }
};

// Reads the whole folder; no server may use it meanwhile (kFailedPrecondition). With `repair`
// damaged blobs are set aside, so that an upload or another run puts good ones in their place.
// `progress` is told how many blobs have been read.
FsckResult Fsck(const std::filesystem::path& data_folder,
                bool repair,
                const std::function<void(int64_t blobs)>& progress);

}  // namespace color3d
