#include "server/storage/blob_store.h"

namespace color3d {

ListedBlobs ListBlobs(const BlobStore& blobs, const std::function<bool()>& stop) {
  ListedBlobs all;
  all.unreadable = blobs.ForEach([&](const StoredBlob& blob) {
    all.blobs.push_back(blob);
    return !stop();
  });
  return all;
}

std::vector<bool> BlobStore::TouchAll(const std::vector<FileDigest>& digests) const {
  std::vector<bool> stored;
  for (const FileDigest& digest : digests) stored.push_back(Touch(digest));
  return stored;
}

}  // namespace color3d
