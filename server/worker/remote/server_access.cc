#include "server/worker/remote/server_access.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "core/base/error.h"
#include "server/storage/file_blob_store.h"
#include "server/worker/remote/remote_blobs.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

// A worker of an earlier server may still end while another has its name: each needs a folder.
constexpr int kMaxOfOneName = 16;

// Returns a folder that no other process uses, for as long as `lock` is open.
fs::path LockCacheFolder(const DataPaths& paths, const std::string& name, int* lock) {
  for (int i = 0; i < kMaxOfOneName; ++i) {
    const fs::path folder = paths.Cache() / fmt::format("blobs-{}-{}", name, i);
    std::error_code error;
    fs::create_directories(folder, error);
    *lock = ::open((folder / "lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (*lock < 0) {
      throw Error(ErrorCode::kFailedPrecondition,
                  "cannot use the cache folder {}: {}; change its permissions",
                  folder.string(),
                  std::strerror(errno));
    }
    if (::flock(*lock, LOCK_EX | LOCK_NB) == 0) return folder;
    ::close(std::exchange(*lock, -1));
  }
  throw Error(ErrorCode::kFailedPrecondition,
              "{} workers named {} use {}; end those of earlier servers",
              kMaxOfOneName,
              name,
              paths.Cache().string());
}

}  // namespace

ServerAccess::ServerAccess(const DataPaths& paths,
                           const LinkTiming& timing,
                           const std::string& release,
                           int64_t reserve_bytes,
                           const LocalCache& cache)
    : sockets_(paths.Sockets()),
      link_({sockets_->Address(kWorkerSocket)}, timing),
      heartbeat_link_({sockets_->Address(kWorkerSocket)}, timing),
      store_(link_, release),
      heartbeat_store_(heartbeat_link_, release),
      logs_(std::make_shared<LogSender>(heartbeat_link_)) {
  if (cache.bytes == 0) {
    blobs_ = std::make_unique<FileBlobStore>(paths.Blobs(), BlobStoreOptions{reserve_bytes});
    return;
  }
  cache_.emplace(LockCacheFolder(paths, cache.name, &cache_lock_), cache.bytes);
  blobs_ = std::make_unique<RemoteBlobs>(link_, *cache_);
}

ServerAccess::~ServerAccess() {
  blobs_.reset();
  cache_.reset();
  if (cache_lock_ >= 0) ::close(cache_lock_);
}

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
