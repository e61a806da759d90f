// Files of this machine that the service has: each is read and sent once while it stays the same.
// Thread-safe.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>

#include "client/lib/connection.h"
#include "color3d/v1/blob.pb.h"
#include "core/base/digest.h"
#include "core/base/mutex.h"

namespace color3d::client {

class KeptBlobs {
 public:
  // Returns the digest of a file that the service has, after sending it if it is new. Throws what
  // UploadMissing throws.
  v1::Digest Of(Connection& connection, const std::filesystem::path& file);
  // The service lost its blobs: sends files again.
  void Forget();

 private:
  struct Known {
    std::filesystem::file_time_type changed;
    uintmax_t bytes = 0;
    FileDigest digest;
  };
  static constexpr size_t kMost = 1000;

  Mutex mutex_;
  std::map<std::filesystem::path, Known> known_ COLOR3D_GUARDED_BY(mutex_);
};

}  // namespace color3d::client
