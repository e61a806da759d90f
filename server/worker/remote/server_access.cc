#include "server/worker/remote/server_access.h"

#include "server/storage/file_blob_store.h"
#include "server/worker/remote/remote_blobs.h"

namespace color3d {

ServerAccess::ServerAccess(const DataPaths& paths,
                           const LinkTiming& timing,
                           const std::string& release,
                           int64_t reserve_bytes)
    : sockets_(paths.Sockets()),
      link_({sockets_->Address(kWorkerSocket)}, timing),
      heartbeat_link_({sockets_->Address(kWorkerSocket)}, timing),
      store_(link_, release),
      heartbeat_store_(heartbeat_link_, release),
      blobs_(std::make_unique<FileBlobStore>(paths.Blobs(), BlobStoreOptions{reserve_bytes})),
      logs_(std::make_shared<LogSender>(heartbeat_link_)) {}

ServerAccess::ServerAccess(const DataPaths& paths,
                           const LinkTiming& timing,
                           const std::string& release,
                           const WorkerTarget& target,
                           int64_t cache_bytes)
    : link_(target, timing),
      heartbeat_link_(target, timing),
      store_(link_, release),
      heartbeat_store_(heartbeat_link_, release) {
  cache_.emplace(paths.Blobs(), cache_bytes);
  blobs_ = std::make_unique<RemoteBlobs>(link_, *cache_);
  logs_ = std::make_shared<LogSender>(heartbeat_link_);
}

}  // namespace color3d
