// State of the configured model servers, for listings.
#pragma once

#include <chrono>
#include <map>
#include <string>

#include "core/base/mutex.h"
#include "core/keycolor/external/remote.h"

namespace grpc {
class Channel;
}

namespace color3d {

struct ProbeAnswer {
  bool reachable = false;
  bool ready = false;
  RemoteInfo info;
  std::string problem;  // why it is not ready; empty: ready
};

// Thread-safe. A second caller waits for the running probe.
class BackendProber {
 public:
  // Addresses by name, validated by ParseBackendAddress.
  explicit BackendProber(const std::map<std::string, std::string>& backends,
                         std::chrono::milliseconds deadline = std::chrono::milliseconds(1'500),
                         std::chrono::milliseconds keep = std::chrono::milliseconds(3'000));
  ~BackendProber();

  // Probes all backends at once; takes at most the deadline. Answers are cached for a moment.
  std::map<std::string, ProbeAnswer> Probe();

 private:
  const std::chrono::milliseconds deadline_;
  const std::chrono::milliseconds keep_;
  std::map<std::string, std::shared_ptr<grpc::Channel>> channels_;
  Mutex mutex_;
  std::chrono::steady_clock::time_point asked_ COLOR3D_GUARDED_BY(mutex_);
  std::map<std::string, ProbeAnswer> answers_ COLOR3D_GUARDED_BY(mutex_);
};

}  // namespace color3d
