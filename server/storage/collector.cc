#include "server/storage/collector.h"

#include <map>
#include <set>

namespace color3d {

std::vector<StoredBlob> DueBlobs(JobStore& store,
                                 const std::vector<StoredBlob>& blobs,
                                 std::chrono::milliseconds grace) {
  const std::set<std::string> named = store.ReferencedBlobs();
  std::vector<BlobCandidate> unnamed;
  std::map<std::string, int64_t> sizes;
  for (const StoredBlob& blob : blobs) {
    if (named.contains(blob.digest.sha256)) continue;
    unnamed.push_back({blob.digest.sha256, blob.touched_ns});
    sizes[blob.digest.sha256] = blob.digest.size_bytes;
  }
  std::vector<StoredBlob> due;
  for (const BlobCandidate& candidate : store.AgeCandidates(unnamed, grace.count())) {
    due.push_back({{candidate.sha256, sizes[candidate.sha256]}, candidate.touched_ns});
  }
  return due;
}

// Whoever puts or looks for a blob touches it, before he names it.
std::vector<FileDigest> RemoveDue(JobStore& store,
                                  BlobStore& blobs,
                                  const std::vector<StoredBlob>& due) {
  std::vector<FileDigest> removed;
  for (const StoredBlob& blob : due) {
    if (store.IsReferenced(blob.digest.sha256) || !blobs.RemoveIfUntouched(blob)) continue;
    store.ForgetBlob(blob.digest.sha256);
    removed.push_back(blob.digest);
  }
  return removed;
}

}  // namespace color3d
