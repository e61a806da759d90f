// What the configured model servers say of themselves, for people who list them.
#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <string>

#include "core/keycolor/external/remote.h"

namespace grpc {
class Channel;
}

namespace color3d {

struct ProbeAnswer {
  bool reachable = false;
  bool ready = false;
  RemoteInfo info;
  std::string problem;  // why it is not ready; empty: it is
};

// Thread-safe. A second caller waits for the probe that is running.
class BackendProber {
 public:
  // Addresses by name, checked before (ParseBackendAddress).
  explicit BackendProber(const std::map<std::string, std::string>& backends,
                         std::chrono::milliseconds deadline = std::chrono::milliseconds(1'500),
                         std::chrono::milliseconds keep = std::chrono::milliseconds(3'000));
  ~BackendProber();

  // All of them at once; takes the deadline at most. Answers are kept a moment.
  std::map<std::string, ProbeAnswer> Probe();

 private:
  const std::chrono::milliseconds deadline_;
  const std::chrono::milliseconds keep_;
  std::map<std::string, std::shared_ptr<grpc::Channel>> channels_;
  std::mutex mutex_;
  std::chrono::steady_clock::time_point asked_;
  std::map<std::string, ProbeAnswer> answers_;
};

}  // namespace color3d
