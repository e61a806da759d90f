#include "server/net/port_probe.h"

#include <curl/curl.h>
#include <fmt/format.h>

#include <array>
#include <memory>
#include <string_view>

#include "core/base/text/address.h"

namespace color3d {
namespace {

struct CurlDeleter {
  void operator()(CURL* curl) const { curl_easy_cleanup(curl); }
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};

size_t Discard(char*, size_t size, size_t count, void*) { return size * count; }

// Host under which a socket that listens on all interfaces is reached.
std::string ReachableAddress(const std::string& address) {
  const HostPort parts = SplitHostPort(address);
  const bool everywhere = parts.host == "0.0.0.0" || parts.host == "::";
  const std::string host = everywhere ? "127.0.0.1" : parts.host;
  const bool is_v6 = host.find(':') != std::string::npos;
  return (is_v6 ? "[" + host + "]" : host) + ":" + parts.port;
}

}  // namespace

std::string ProbePort(const ProbeTarget& target, std::chrono::milliseconds limit) {
  constexpr std::string_view kUnix = "unix:";
  const std::unique_ptr<CURL, CurlDeleter> handle(curl_easy_init());
  CURL* curl = handle.get();
  if (curl == nullptr) return "libcurl cannot be initialized";
  const bool is_unix = target.address.starts_with(kUnix);
  const std::string url = fmt::format("{}://{}/grpc.health.v1.Health/Check",
                                      target.tls ? "https" : "http",
                                      is_unix ? "localhost" : ReachableAddress(target.address));
  std::string path = is_unix ? target.address.substr(kUnix.size()) : "";
  if (path.starts_with("//")) path.erase(0, 2);
  std::unique_ptr<curl_slist, CurlDeleter> headers;
  for (const char* header : {"Content-Type: application/grpc", "TE: trailers", "Expect:"}) {
    headers.reset(curl_slist_append(headers.release(), header));
  }
  static constexpr std::array<char, 5> kEmptyMessage{};  // uncompressed, empty
  if (is_unix) curl_easy_setopt(curl, CURLOPT_UNIX_SOCKET_PATH, path.c_str());
  curl_easy_setopt(curl, CURLOPT_URL, url.c_str());
  curl_easy_setopt(
      curl,
      CURLOPT_HTTP_VERSION,
      static_cast<long>(target.tls ? CURL_HTTP_VERSION_2TLS : CURL_HTTP_VERSION_2_PRIOR_KNOWLEDGE));
  curl_easy_setopt(curl, CURLOPT_SSL_VERIFYPEER, 0L);
  curl_easy_setopt(curl, CURLOPT_SSL_VERIFYHOST, 0L);
  curl_easy_setopt(curl, CURLOPT_PROXY, "");
  curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(curl, CURLOPT_TIMEOUT_MS, static_cast<long>(limit.count()));
  curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT_MS, static_cast<long>(limit.count()));
  curl_easy_setopt(curl, CURLOPT_HTTPHEADER, headers.get());
  curl_easy_setopt(curl, CURLOPT_POSTFIELDSIZE, static_cast<long>(kEmptyMessage.size()));
  curl_easy_setopt(curl, CURLOPT_POSTFIELDS, kEmptyMessage.data());
  curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, Discard);
  std::array<char, CURL_ERROR_SIZE> why{};
  curl_easy_setopt(curl, CURLOPT_ERRORBUFFER, why.data());
  const CURLcode code = curl_easy_perform(curl);
  long status = 0;
  curl_off_t handshake_us = 0;
  curl_easy_getinfo(curl, CURLINFO_RESPONSE_CODE, &status);
  curl_easy_getinfo(curl, CURLINFO_APPCONNECT_TIME_T, &handshake_us);
  // A completed TLS handshake proves that the server answers, even if it then demands a
  // certificate.
  if (status != 0 || (code != CURLE_OPERATION_TIMEDOUT && handshake_us > 0)) return "";
  return why[0] != '\0' ? why.data() : curl_easy_strerror(code);
}

}  // namespace color3d
