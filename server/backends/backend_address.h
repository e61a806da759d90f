// Addresses of model servers, and channels to them.
#pragma once

#include <grpcpp/channel.h>

#include <memory>
#include <string>

namespace color3d {

struct BackendAddress {
  std::string target;  // HOST:PORT or unix:PATH
  bool tls = false;
};

// HOST:PORT and unix:PATH are unencrypted and must be on this machine. https://HOST:PORT uses TLS,
// checked against the root certificates of the system (or of the file named by
// GRPC_DEFAULT_SSL_ROOTS_FILE_PATH). http://HOST:PORT is unencrypted on any machine. Throws
// Error{kInvalidArgument} naming the backend and the problem.
BackendAddress ParseBackendAddress(const std::string& name, const std::string& address);

// Does not connect yet. Messages above `max_message_bytes` are refused in both directions.
std::shared_ptr<grpc::Channel> OpenBackend(const BackendAddress& address, int max_message_bytes);

}  // namespace color3d
