#include "server/keeping/fsck.h"

#include <set>

#include "core/base/digest.h"
#include "server/storage/data_folder.h"
#include "server/storage/file_blob_store.h"
#include "server/store/sqlite_job_store.h"
#include "server/store/store_file.h"

namespace color3d {
namespace fs = std::filesystem;

FsckResult Fsck(const fs::path& data_folder,
                bool repair,
                const std::function<void(int64_t blobs)>& progress) {
  const DataPaths paths(data_folder);
  RequireStore(paths.Store());
  const DataFolderLock lock(paths);
  FsckResult result;
  result.store_problems = StoreProblems(paths.Store());
  if (!result.store_problems.empty()) return result;  // what it names cannot be believed
  std::set<std::string> named =
      SqliteJobStore(paths.Store(), StoreRole::kWorker, SystemClocks()).ReferencedBlobs();
  FileBlobStore blobs(paths.Blobs());
  std::vector<std::string> damaged;
  blobs.ForEach([&](const StoredBlob& blob) {
    const bool is_named = named.erase(blob.digest.sha256) > 0;
    if (!IsIntact(blobs, blob.digest)) {
      damaged.push_back(blob.digest.sha256);
      if (is_named) result.damaged.push_back(blob.digest.sha256);
      result.damaged_unnamed += is_named ? 0 : 1;
    }
    result.unnamed += is_named ? 0 : 1;
    result.bytes += blob.digest.size_bytes;
    progress(++result.blobs);
    return true;
  });
  result.missing.assign(named.begin(), named.end());
  if (repair) {
    for (const std::string& sha256 : damaged) blobs.SetAside(sha256);
  }
  return result;
}

}  // namespace color3d
