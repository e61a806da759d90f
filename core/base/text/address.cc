#include "core/base/text/address.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/un.h>

#include <string_view>

#include "core/base/error.h"

namespace color3d {

HostPort SplitHostPort(const std::string& text) {
  const size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon + 1 == text.size()) {
    throw InvalidArgument("'{}' is not an address; give HOST:PORT, e.g. 127.0.0.1:50551", text);
  }
  std::string host = text.substr(0, colon);
  if (host.size() > 1 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  }
  return {host, text.substr(colon + 1)};
}

void CheckAddressForm(const std::string& flag, const std::string& address) {
  constexpr std::string_view kUnix = "unix:";
  constexpr size_t kMostPathBytes = sizeof(sockaddr_un::sun_path) - 1;
  if (address.starts_with(kUnix)) {
    std::string_view path = std::string_view(address).substr(kUnix.size());
    if (path.starts_with("//")) path.remove_prefix(2);
    if (path.empty()) throw InvalidArgument("{} {}: the path is missing", flag, address);
    if (path.size() > kMostPathBytes) {
      throw InvalidArgument(
          "{} {}: the path has {} bytes, a Unix socket's may have {}; take a shorter one, e.g. "
          "unix:/tmp/color3d.sock",
          flag,
          address,
          path.size(),
          kMostPathBytes);
    }
    return;
  }
  const size_t scheme_end = address.find("://");
  if (scheme_end == std::string::npos) return;
  const size_t start = scheme_end + 3;
  throw InvalidArgument("{} {}: {} is not needed; say {} {}",
                        flag,
                        address,
                        address.substr(0, start),
                        flag,
                        address.substr(start, address.find('/', start) - start));
}

bool IsLoopback(const std::string& address) {
  if (address.starts_with("unix:")) return true;
  const std::string host = SplitHostPort(address).host;
  if (host == "localhost") return true;
  in_addr v4{};
  if (::inet_pton(AF_INET, host.c_str(), &v4) == 1) return ntohl(v4.s_addr) >> 24u == 127u;
  in6_addr v6{};
  return ::inet_pton(AF_INET6, host.c_str(), &v6) == 1 && IN6_IS_ADDR_LOOPBACK(&v6) != 0;
}

}  // namespace color3d
