#include "client/studio/kept_blobs.h"

#include "client/lib/blob_transfer.h"
#include "client/lib/scene_upload.h"

namespace color3d::client {
namespace fs = std::filesystem;

v1::Digest KeptBlobs::Of(Connection& connection, const fs::path& file) {
  std::error_code error;
  Known now{fs::last_write_time(file, error), 0, {}};
  if (!error) now.bytes = fs::file_size(file, error);
  {
    const MutexLock lock(mutex_);
    const auto found = known_.find(file);
    if (!error && found != known_.end() && found->second.changed == now.changed &&
        found->second.bytes == now.bytes) {
      return ToProto(found->second.digest);
    }
  }
  now.digest = DigestFile(file);
  UploadMissing(connection, {{file, now.digest}}, [](int64_t, int64_t) {});
  const MutexLock lock(mutex_);
  if (known_.size() >= kMost) known_.clear();
  known_[file] = now;
  return ToProto(now.digest);
}

void KeptBlobs::Forget() {
  const MutexLock lock(mutex_);
  known_.clear();
}

}  // namespace color3d::client
