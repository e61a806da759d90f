// Unreferenced blobs: found in two phases, whose state is in the store, and removed.
#pragma once

#include <chrono>
#include <functional>
#include <vector>

#include "server/storage/blob_store.h"
#include "server/store/chore_store.h"

namespace color3d {

// Blobs of `blobs`, which are all that there are, that nothing names and that were noted so, and
// untouched since, for the time of grace. Takes note of those that are found for the first time.
std::vector<StoredBlob> DueBlobs(ChoreStore& store,
                                 const std::vector<StoredBlob>& blobs,
                                 std::chrono::milliseconds grace);

// The same by what was noted before, without another note.
std::vector<StoredBlob> DueBlobsSoFar(ChoreStore& store,
                                      const std::vector<StoredBlob>& blobs,
                                      std::chrono::milliseconds grace);

// Those of `due` that were removed: still unnamed and untouched. `stop` is asked between them.
std::vector<FileDigest> RemoveDue(ChoreStore& store,
                                  BlobStore& blobs,
                                  const std::vector<StoredBlob>& due,
                                  const std::function<bool()>& stop);

}  // namespace color3d
