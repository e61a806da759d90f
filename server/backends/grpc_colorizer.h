// A user's model server as a RemoteColorizer: color3d.backend.v1.ColorBackend over gRPC.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <string>

#include "core/keycolor/external/remote.h"
#include "server/backends/backend_address.h"

namespace color3d {

struct GrpcColorizerOptions {
  // Maximum time of a Colorize call; below the time after which a silent stage counts as stuck.
  std::chrono::milliseconds deadline{600'000};
  std::chrono::milliseconds info_deadline{5'000};
  // Maximum time to wait for a backend that loads its model.
  std::chrono::milliseconds ready_patience{60'000};
  std::chrono::milliseconds ready_poll{500};
  // UNAVAILABLE is retried; each pause is twice the one before.
  int tries = 4;
  std::chrono::milliseconds first_backoff{300};
  int max_message_bytes = 256 << 20;
  std::string traceparent;  // W3C traceparent, sent with the calls of a job; empty: none
};

// Connects on first use. Throws Error{kInvalidArgument} for a bad address.
std::unique_ptr<RemoteColorizer> MakeGrpcColorizer(const std::string& name,
                                                   const std::string& address,
                                                   const GrpcColorizerOptions& options = {});

// Returns one of the configured backends. Throws Error{kFailedPrecondition} with their names.
std::unique_ptr<RemoteColorizer> MakeGrpcColorizer(
    const std::map<std::string, std::string>& backends,
    const std::string& name,
    const GrpcColorizerOptions& options = {});

}  // namespace color3d
