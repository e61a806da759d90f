// Copies of a data folder that can be served in its place.
#pragma once

#include <cstdint>
#include <filesystem>

namespace color3d {

struct CopiedBlobs {
  int64_t copied = 0;
  int64_t kept = 0;  // there already, from an earlier copy
  int64_t bytes = 0;
};

// Everything that jobs and scenes name, as it is at one moment; a server may run meanwhile. Into an
// empty folder, or over an earlier backup, of which blobs that are there are not copied again. The
// store is replaced last: a backup that was cut off is the earlier one still. Throws Error:
// kFailedPrecondition where there is no store of this release or `target` is none of ours,
// kDataLoss naming a blob that is missing or damaged.
CopiedBlobs BackUp(const std::filesystem::path& data_folder, const std::filesystem::path& target);

// A backup as a fresh data folder. Every blob is read and compared with its digest. Throws as
// BackUp, and kFailedPrecondition unless `data_folder` is empty or not there.
CopiedBlobs Restore(const std::filesystem::path& backup, const std::filesystem::path& data_folder);

}  // namespace color3d
