// Removal of unreferenced blobs in two phases, whose state is in the job store. Stateless.
#pragma once

#include <chrono>
#include <functional>
#include <vector>

#include "server/storage/blob_store.h"
#include "server/store/chore_store.h"

namespace color3d {

// Returns unreferenced blobs that have been marked and untouched for the grace period, and marks
// new ones. Requires: `blobs` has all blobs.
std::vector<StoredBlob> DueBlobs(ChoreStore& store,
                                 const std::vector<StoredBlob>& blobs,
                                 std::chrono::milliseconds grace);

// The same by the present marks; marks nothing.
std::vector<StoredBlob> DueBlobsSoFar(ChoreStore& store,
                                      const std::vector<StoredBlob>& blobs,
                                      std::chrono::milliseconds grace);

// Removes those of `due` that are still unreferenced and untouched, until `stop` returns true.
// Returns the removed blobs.
std::vector<FileDigest> RemoveDue(ChoreStore& store,
                                  BlobStore& blobs,
                                  const std::vector<StoredBlob>& due,
                                  const std::function<bool()>& stop);

}  // namespace color3d
