// Copies of a data folder that can be served in its place.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace color3d {

struct CopiedBlobs {
  int64_t copied = 0;
  int64_t kept = 0;    // there already, from an earlier copy
  int64_t mended = 0;  // of those copied: damaged in the earlier copy
  int64_t bytes = 0;
  std::vector<std::string> missing, damaged;  // digests that jobs or scenes name; not in the copy
  // "DIGEST: REASON": whether they are there and good is not known; not in the copy.
  std::vector<std::string> unreadable;
  int64_t awaited = 0;  // not uploaded yet, for scenes that are not committed

  bool IsWhole() const { return missing.empty() && damaged.empty() && unreadable.empty(); }
};

// Everything that jobs and scenes name, as it is at one moment; a server may run meanwhile. Into an
// empty folder, or over an earlier backup, of which blobs that are there are read and compared with
// their digest, and copied again only where they are damaged. The store is replaced last: a backup
// that was cut off is the earlier one still. Blobs that are missing or damaged are left out and
// listed; a job whose checkpoint was one, or was replaced meanwhile, begins anew in the copy. What
// a scene that is not committed still waits for is no fault. Throws Error: kFailedPrecondition
// where there is no store of this release or `target` is none of ours.
CopiedBlobs BackUp(const std::filesystem::path& data_folder, const std::filesystem::path& target);

// A backup as a fresh data folder. Every blob is read and compared with its digest. As BackUp, and
// throws kFailedPrecondition unless `data_folder` is empty or not there.
CopiedBlobs Restore(const std::filesystem::path& backup, const std::filesystem::path& data_folder);

}  // namespace color3d
