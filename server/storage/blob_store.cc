#include "server/storage/blob_store.h"

namespace color3d {

std::vector<StoredBlob> ListBlobs(const BlobStore& blobs, const std::function<bool()>& stop) {
  std::vector<StoredBlob> all;
  blobs.ForEach([&](const StoredBlob& blob) {
    all.push_back(blob);
    return !stop();
  });
  return all;
}

bool IsIntact(const BlobStore& blobs, const FileDigest& digest) {
  const FileDigest actual = DigestFile(blobs.Fetch(digest.sha256));
  return actual.sha256 == digest.sha256 && actual.size_bytes == digest.size_bytes;
}

}  // namespace color3d
