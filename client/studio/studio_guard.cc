#include "client/studio/studio_guard.h"

#include <fmt/core.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "client/studio/http_library.h"
#include "core/base/error.h"

namespace color3d::client {
namespace {

constexpr char kOpenAgain[] = "end the studio and run `color3d studio` again for a new address";

// Returns the value of the cookie, "" if there is none or several.
std::string CookieOf(const httplib::Request& request, const std::string& name) {
  std::string found;
  int count = 0;
  const auto [begin, end] = request.headers.equal_range("Cookie");
  for (auto header = begin; header != end; ++header) {
    const std::string& text = header->second;
    for (size_t at = 0; at < text.size();) {
      const size_t stop = std::min(text.find(';', at), text.size());
      size_t first = text.find_first_not_of(' ', at);
      if (first != text.npos && text.compare(first, name.size() + 1, name + "=") == 0) {
        first += name.size() + 1;
        found = text.substr(first, stop - first);
        ++count;
      }
      at = stop + 1;
    }
  }
  return count == 1 ? found : "";
}

bool ChangesSomething(const std::string& method) { return method != "GET" && method != "HEAD"; }

}  // namespace

std::string NewSecret() {
  std::array<unsigned char, 32> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw Error(ErrorCode::kInternal, "the system has no random numbers: {}", std::strerror(errno));
  }
  std::string hex;
  for (const unsigned char byte : bytes) hex += fmt::format("{:02x}", byte);
  return hex;
}

bool AreEqualSecrets(const std::string& left, const std::string& right) {
  if (left.size() != right.size()) return false;
  volatile unsigned char different = 0;
  for (size_t i = 0; i < left.size(); ++i) {
    different = static_cast<unsigned char>(different | (left[i] ^ right[i]));
  }
  return different == 0;
}

StudioGuard::StudioGuard(int port)
    : token_(NewSecret()),
      session_(NewSecret()),
      port_(std::to_string(port)),
      // Browsers do not keep the cookies of two ports apart.
      cookie_("color3d_studio_" + port_) {}

std::string StudioGuard::Exchange(const std::string& token) {
  if (!AreEqualSecrets(token, token_)) return "";
  const MutexLock lock(mutex_);
  if (is_used_) return "";
  is_used_ = true;
  return fmt::format("{}={}; Path=/; HttpOnly; SameSite=Strict", cookie_, session_);
}

bool StudioGuard::is_used() const {
  const MutexLock lock(mutex_);
  return is_used_;
}

StudioGuard::Verdict StudioGuard::CheckOrigin(const httplib::Request& request) const {
  const std::string host = request.get_header_value("Host");
  const bool is_own_host = host == "127.0.0.1:" + port_ || host == "localhost:" + port_;
  if (request.get_header_value_count("Host") != 1 || !is_own_host) {
    return {421, "the studio answers at 127.0.0.1 only"};
  }
  const size_t origins = request.get_header_value_count("Origin");
  if (origins > 1 || (origins == 1 && request.get_header_value("Origin") != "http://" + host)) {
    return {403, "another page may not use the studio"};
  }
  if (origins == 0 && ChangesSomething(request.method)) {
    return {403, "the request does not say which page it is from (Origin)"};
  }
  return {};
}

StudioGuard::Verdict StudioGuard::CheckCookie(const httplib::Request& request) const {
  if (AreEqualSecrets(CookieOf(request, cookie_), session_)) return {};
  return {403,
          std::string("this browser was not let in: open the address that `color3d studio` "
                      "printed; it works once. Otherwise ") +
              kOpenAgain};
}

}  // namespace color3d::client
