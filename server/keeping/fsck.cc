#include "server/keeping/fsck.h"

#include <memory>
#include <set>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "server/storage/data_folder.h"
#include "server/storage/file_blob_store.h"
#include "server/store/open_store.h"
#include "server/store/store_file.h"

namespace color3d {
namespace fs = std::filesystem;

FsckResult Fsck(const fs::path& data_folder,
                const std::string& address,
                BlobStore* elsewhere,
                bool repair,
                const std::function<void(int64_t blobs)>& progress) {
  const DataPaths paths(data_folder);
  if (address.empty()) RequireStore(paths.Store());
  const DataFolderLock lock(paths);
  if (const std::string place = BlobPlaceOf(paths); elsewhere == nullptr && !place.empty()) {
    throw Error(ErrorCode::kFailedPrecondition,
                "the blobs of {} are in {}; give --blobs and the flags of the object store",
                data_folder.string(),
                place);
  }
  FsckResult result;
  if (address.empty()) result.store_problems = StoreProblems(paths.Store());
  if (!result.store_problems.empty()) return result;  // its references are unreliable
  const std::unique_ptr<JobStore> store = OpenStoreAsTool(address, paths.Store());
  std::set<std::string> named = store->ReferencedBlobs();
  FileBlobStore in_folder(paths.Blobs());
  BlobStore& blobs = elsewhere != nullptr ? *elsewhere : in_folder;
  std::vector<std::string> damaged;
  const auto check = [&](const StoredBlob& blob) {
    const bool is_named = named.erase(blob.digest.sha256) > 0;
    result.unnamed += is_named ? 0 : 1;
    try {
      if (!IsIntact(blobs, blob.digest)) {
        damaged.push_back(blob.digest.sha256);
        if (is_named) result.damaged.push_back(blob.digest.sha256);
        result.damaged_unnamed += is_named ? 0 : 1;
      }
    } catch (const Error& e) {
      result.unreadable.push_back(blob.digest.sha256 + ": " + e.what());
    }
    result.bytes += blob.digest.size_bytes;
    progress(++result.blobs);
    return true;
  };
  const std::vector<std::string> unlisted = blobs.ForEach(check);
  result.unreadable.insert(result.unreadable.end(), unlisted.begin(), unlisted.end());
  // Referenced blobs that the scan did not find are looked up by name.
  const std::set<std::string> awaited = store->AwaitedBlobs();
  for (const std::string& sha256 : std::vector<std::string>(named.begin(), named.end())) {
    try {
      if (const auto blob = blobs.Look(sha256)) {
        check(*blob);
      } else if (awaited.contains(sha256)) {
        ++result.awaited;
      } else {
        result.missing.push_back(sha256);
      }
    } catch (const Error& e) {
      result.unreadable.push_back(sha256 + ": " + e.what());
    }
  }
  if (repair) {
    for (const std::string& sha256 : damaged) blobs.SetAside(sha256);
  }
  return result;
}

}  // namespace color3d
