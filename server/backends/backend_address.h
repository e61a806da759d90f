// Where a model server of the user's listens, and how it is spoken to.
#pragma once

#include <grpcpp/channel.h>

#include <memory>
#include <string>

namespace color3d {

struct BackendAddress {
  std::string target;  // HOST:PORT or unix:PATH
  bool tls = false;
};

// HOST:PORT and unix:PATH are spoken to in the clear, and must be on this machine;
// https://HOST:PORT with TLS, checked against the roots of the system (or those in the file that
// GRPC_DEFAULT_SSL_ROOTS_FILE_PATH names); http://HOST:PORT in the clear anywhere: photos then
// travel as they are. Throws Error{kInvalidArgument} naming the backend and what is wrong.
BackendAddress ParseBackendAddress(const std::string& name, const std::string& address);

// Does not connect yet. Messages beyond `max_message_bytes` are refused in both directions.
std::shared_ptr<grpc::Channel> OpenBackend(const BackendAddress& address, int max_message_bytes);

}  // namespace color3d
