#include "server/backends/backend_address.h"

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>

#include <algorithm>
#include <cctype>

#include "core/base/error.h"
#include "core/base/text/address.h"

namespace color3d {
namespace {

constexpr char kHttp[] = "http://";
constexpr char kHttps[] = "https://";

void RequireHostPort(const std::string& flag, const std::string& target) {
  std::string host, port;
  try {
    const HostPort parts = SplitHostPort(target);
    host = parts.host;
    port = parts.port;
  } catch (const Error& error) {
    throw InvalidArgument("{}: {}", flag, error.what());
  }
  const bool number = port.size() <= 5 && std::all_of(port.begin(), port.end(), [](char c) {
                        return std::isdigit(static_cast<unsigned char>(c)) != 0;
                      });
  const bool good = !host.empty() && host.find('/') == std::string::npos && number &&
                    std::stoi(port) >= 1 && std::stoi(port) <= 65535;
  if (!good) throw InvalidArgument("{}: '{}' is not HOST:PORT with a port number", flag, target);
}

}  // namespace

BackendAddress ParseBackendAddress(const std::string& name, const std::string& address) {
  const std::string flag = "--backend " + name + "=" + address;
  if (address.starts_with("unix:")) {
    CheckAddressForm("--backend " + name, address);
    return {address, false};
  }
  BackendAddress result{address, address.starts_with(kHttps)};
  const bool http = address.starts_with(kHttp);
  if (http) result.target = address.substr(sizeof(kHttp) - 1);
  if (result.tls) result.target = address.substr(sizeof(kHttps) - 1);
  RequireHostPort(flag, result.target);
  if (!http && !result.tls && !IsLoopback(result.target)) {
    throw InvalidArgument(
        "{} is another machine, and photos would be sent unencrypted; use {}{} (TLS), or {}{} in "
        "a trusted network",
        flag,
        kHttps,
        result.target,
        kHttp,
        result.target);
  }
  return result;
}

std::shared_ptr<grpc::Channel> OpenBackend(const BackendAddress& address, int max_message_bytes) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(max_message_bytes);
  arguments.SetMaxSendMessageSize(max_message_bytes);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 2'000);
  // A proxy of the environment is for the web, not for a server that the user has named.
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  const auto credentials = address.tls ? grpc::SslCredentials(grpc::SslCredentialsOptions())
                                       : grpc::InsecureChannelCredentials();
  return grpc::CreateCustomChannel(address.target, credentials, arguments);
}

}  // namespace color3d
