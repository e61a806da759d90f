// Metrics of the server for Prometheus:
// https://prometheus.io/docs/instrumenting/exposition_formats/ Names begin with "color3d_"; label
// values are never chosen by users.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "server/storage/blob_store.h"
#include "server/store/client_store.h"

namespace color3d {

// State of the server's parts at one time.
struct ServerSample {
  // Numbers of open streams and of pending pictures.
  int watches = 0, downloads = 0, uploads = 0, live_pictures = 0;
  bool draining = false;
  bool answering = true;  // the server answers its own calls
  int64_t connections = 0, silent_connections = 0, max_connections = 0;
  // Counts since the start.
  int64_t attempts_lost = 0, blobs_removed = 0, blobs_damaged = 0, jobs_expired = 0,
          sweeps_failed = 0, connections_closed = 0, connections_refused = 0, spans_dropped = 0;
  int64_t reserve_bytes = 0;      // free space to be kept
  int64_t certificate_end_s = 0;  // since the epoch; 0: no TLS
};

// Thread-safe.
class ServerMetrics {
 public:
  explicit ServerMetrics(const std::string& version);
  ~ServerMetrics();
  ServerMetrics(const ServerMetrics&) = delete;
  ServerMetrics& operator=(const ServerMetrics&) = delete;

  // `method`: "/color3d.v1.JobService/GetJob"; `code`: "OK", "NOT_FOUND", ...
  void CountCall(const std::string& method, const std::string& code, double seconds);

  // Serves GET /metrics on HOST:PORT (port 0: any free port), from stores that outlive this object.
  // Returns the port. Throws Error{kFailedPrecondition} if the address cannot be used.
  int Listen(const std::string& address,
             ClientStore& store,
             const BlobStore& blobs,
             std::function<ServerSample()> sample);
  // Must be called before objects used by `sample` are destroyed.
  void StopListening();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace color3d
