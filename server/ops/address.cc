#include "server/ops/address.h"

#include "core/base/error.h"

namespace color3d {

HostPort SplitHostPort(const std::string& text) {
  const size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon + 1 == text.size()) {
    throw InvalidArgument("'{}' is no address: it must be HOST:PORT, e.g. 127.0.0.1:50551", text);
  }
  std::string host = text.substr(0, colon);
  if (host.size() > 1 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  }
  return {host, text.substr(colon + 1)};
}

bool IsLoopback(const std::string& address) {
  if (address.starts_with("unix:")) return true;
  const std::string host = SplitHostPort(address).host;
  return host == "localhost" || host == "::1" || host.starts_with("127.");
}

}  // namespace color3d
