// Settings that `serve` passes to its worker processes as flags: fields, defaults and hidden flags
// of both programs. A plain value.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace color3d {

struct WorkerSettings {
  std::filesystem::path data_folder;
  int threads = 1;
  int64_t memory_mib = 0;  // per process, including started ones; 0: no limit
  bool sandbox = true;     // if the kernel supports it
  std::string log_level = "info";
  std::string log_format = "text";  // or "json"
  int64_t reserve_mib = 256;        // disk space to keep free
  // Cache of blobs of each worker, MiB; 0: they share the folder of blobs of their server.
  int64_t blob_cache_mib = 0;
  bool sends_logs = false;    // lines of job logs go to the server, not to its data folder
  std::string otlp_endpoint;  // of traces; empty: that of the environment, if there is one
  double drain_grace_seconds = 15.0;
  // Hidden flags of both programs, for tests (VisitTimings).
  double lease_seconds = 60.0;
  double heartbeat_seconds = 10.0;
  double checkpoint_seconds = 20.0;
  double stuck_seconds = 900.0;
  double stop_grace_seconds = 60.0;
  int64_t retry_backoff_ms = 2'000;
};

// Calls visit(flag, member) for each timing that is a hidden flag of `serve` and of the worker.
template <typename Settings, typename Visit>
void VisitTimings(Settings& settings, const Visit& visit) {
  visit("--lease-seconds", settings.lease_seconds);
  visit("--heartbeat-seconds", settings.heartbeat_seconds);
  visit("--checkpoint-seconds", settings.checkpoint_seconds);
  visit("--stuck-seconds", settings.stuck_seconds);
  visit("--stop-grace-seconds", settings.stop_grace_seconds);
  visit("--retry-backoff-ms", settings.retry_backoff_ms);
}

// Returns the flags from which a worker process reads these settings.
std::vector<std::string> ToFlags(const WorkerSettings& settings);

}  // namespace color3d
