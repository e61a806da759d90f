#include "server/storage/collector.h"

#include <map>
#include <set>

namespace color3d {

namespace {

std::map<std::string, StoredBlob> Unnamed(ChoreStore& store, const std::vector<StoredBlob>& blobs) {
  const std::set<std::string> named = store.ReferencedBlobs();
  std::map<std::string, StoredBlob> unnamed;
  for (const StoredBlob& blob : blobs) {
    if (!named.contains(blob.digest.sha256)) unnamed[blob.digest.sha256] = blob;
  }
  return unnamed;
}

// Candidates that have not changed.
std::vector<StoredBlob> FilterUnnamed(const std::map<std::string, StoredBlob>& unnamed,
                                      const std::vector<BlobCandidate>& candidates) {
  std::vector<StoredBlob> due;
  for (const BlobCandidate& candidate : candidates) {
    const auto blob = unnamed.find(candidate.sha256);
    if (blob != unnamed.end() && blob->second.touched_ns == candidate.touched_ns) {
      due.push_back(blob->second);
    }
  }
  return due;
}

}  // namespace

std::vector<StoredBlob> DueBlobs(ChoreStore& store,
                                 const std::vector<StoredBlob>& blobs,
                                 std::chrono::milliseconds grace) {
  const std::map<std::string, StoredBlob> unnamed = Unnamed(store, blobs);
  std::vector<BlobCandidate> told;
  for (const auto& [sha256, blob] : unnamed) told.push_back({sha256, blob.touched_ns});
  return FilterUnnamed(unnamed, store.AgeCandidates(told, grace.count()));
}

std::vector<StoredBlob> DueBlobsSoFar(ChoreStore& store,
                                      const std::vector<StoredBlob>& blobs,
                                      std::chrono::milliseconds grace) {
  return FilterUnnamed(Unnamed(store, blobs), store.AgedCandidates(grace.count()));
}

// All callers that store or look up a blob touch it before they name it.
std::vector<FileDigest> RemoveDue(ChoreStore& store,
                                  BlobStore& blobs,
                                  const std::vector<StoredBlob>& due,
                                  const std::function<bool()>& stop) {
  std::vector<FileDigest> removed;
  for (const StoredBlob& blob : due) {
    if (stop()) break;
    if (store.IsReferenced(blob.digest.sha256) || !blobs.RemoveIfUntouched(blob)) continue;
    store.ForgetBlob(blob.digest.sha256);
    removed.push_back(blob.digest);
  }
  return removed;
}

}  // namespace color3d
