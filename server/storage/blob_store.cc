#include "server/storage/blob_store.h"

#include "core/base/error.h"

namespace color3d {

ListedBlobs ListBlobs(const BlobStore& blobs, const std::function<bool()>& stop) {
  ListedBlobs all;
  all.unreadable = blobs.ForEach([&](const StoredBlob& blob) {
    all.blobs.push_back(blob);
    return !stop();
  });
  return all;
}

bool IsIntact(const BlobStore& blobs, const FileDigest& digest) {
  try {
    const FileDigest actual = DigestFile(blobs.Fetch(digest.sha256));
    return actual.sha256 == digest.sha256 && actual.size_bytes == digest.size_bytes;
  } catch (const Error& e) {
    if (e.code() == ErrorCode::kDataLoss) return false;
    throw;
  }
}

}  // namespace color3d
