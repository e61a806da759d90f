// Backup and restoration of data folders. Stateless.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace color3d {

struct CopiedBlobs {
  int64_t copied = 0;
  int64_t kept = 0;    // copied earlier
  int64_t mended = 0;  // copied because the earlier copy was damaged
  int64_t bytes = 0;
  std::vector<std::string> missing, damaged;  // referenced by jobs or scenes; not in the copy
  // "DIGEST: REASON" of blobs that cannot be read; not in the copy.
  std::vector<std::string> unreadable;
  std::string elsewhere;  // object store that keeps the blobs; none was copied
  int64_t awaited = 0;    // not uploaded yet, of uncommitted scenes

  bool IsWhole() const { return missing.empty() && damaged.empty() && unreadable.empty(); }
};

// Copies a snapshot of the store and all referenced blobs to an empty folder or over an earlier
// backup; a server may run meanwhile. Blobs of an earlier backup are verified and copied again only
// if damaged. The store is replaced last, so an interrupted backup remains the earlier one. Missing
// and damaged blobs are listed; jobs whose checkpoint is missing or was replaced meanwhile start
// over in the copy. Blobs that uncommitted scenes still expect are no faults. Throws
// Error{kFailedPrecondition} if there is no store of this release or `target` is neither empty nor
// a backup. If an object store has the blobs, only the store is copied.
CopiedBlobs BackUp(const std::filesystem::path& data_folder, const std::filesystem::path& target);

// Copies a backup to a new data folder and verifies all blobs. Like BackUp; throws
// kFailedPrecondition unless `data_folder` is empty or does not exist.
CopiedBlobs Restore(const std::filesystem::path& backup, const std::filesystem::path& data_folder);

}  // namespace color3d
