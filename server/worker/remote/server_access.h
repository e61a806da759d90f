// What a worker has of its server: job store and blobs. On the server's machine it calls the
// private socket and shares the folder of blobs, so that files are linked and not sent. If that
// server keeps its blobs in an object store, and on another machine, blobs go through the server
// and the worker has a cache: only the server has the keys of the object store. Thread-safe.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "server/ops/socket_folder.h"
#include "server/storage/blob_cache.h"
#include "server/storage/data_folder.h"
#include "server/worker/remote/log_sender.h"
#include "server/worker/remote/remote_store.h"
#include "server/worker/remote/worker_link.h"

namespace color3d {

class ServerAccess {
 public:
  // Cache of a worker on the server's machine.
  struct LocalCache {
    std::string name;   // of the worker; its folder is named by it
    int64_t bytes = 0;  // 0: none, because the folder of blobs is shared
  };
  // On the server's machine: `paths` is its data folder.
  ServerAccess(const DataPaths& paths,
               const LinkTiming& timing,
               const std::string& release,
               int64_t reserve_bytes,
               const LocalCache& cache);
  // On another machine: `paths` is a folder of this worker. Log lines of jobs go to the server.
  ServerAccess(const DataPaths& paths,
               const LinkTiming& timing,
               const std::string& release,
               const WorkerTarget& target,
               int64_t cache_bytes);

  ~ServerAccess();
  ServerAccess(const ServerAccess&) = delete;
  ServerAccess& operator=(const ServerAccess&) = delete;

  WorkerStore& store() { return store_; }
  // For heartbeats: with its own connection, so that transfers do not delay them.
  WorkerStore& heartbeat_store() { return heartbeat_store_; }
  WorkerBlobs& blobs() { return *blobs_; }
  // Without a cache: zeros.
  CacheUse cache_use() const { return cache_ ? cache_->use() : CacheUse{}; }
  const std::shared_ptr<LogSender>& logs() const { return logs_; }

 private:
  std::optional<SocketFolder> sockets_;  // gives addresses that are valid while it lives
  WorkerLink link_, heartbeat_link_;
  RemoteStore store_, heartbeat_store_;
  int cache_lock_ = -1;  // on the folder of a local cache
  std::optional<BlobCache> cache_;
  std::unique_ptr<WorkerBlobs> blobs_;
  std::shared_ptr<LogSender> logs_;
};

}  // namespace color3d
