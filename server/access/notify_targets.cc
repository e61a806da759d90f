#include "server/access/notify_targets.h"

#include <algorithm>
#include <cctype>
#include <string_view>

#include "core/base/error.h"
#include "core/base/text/lower_case.h"

namespace color3d {
namespace {

constexpr size_t kMaxUrlBytes = 1000;

// Nothing that one program reads as another's host or folder.
bool IsPlainUrl(const std::string& url) {
  const size_t scheme = url.starts_with("https://") ? 8 : url.starts_with("http://") ? 7 : 0;
  if (scheme == 0 || url.size() == scheme || url.size() > kMaxUrlBytes) return false;
  const std::string low = LowerCase(url);
  if (low.find("..") != std::string::npos || low.find("%2e") != std::string::npos) return false;
  if (!std::isalnum(static_cast<unsigned char>(url[scheme])) && url[scheme] != '[') return false;
  return std::ranges::all_of(url, [](unsigned char c) {
    return c > 32 && c < 127 &&
           std::string_view("\\@#\"<>^`{|}").find(static_cast<char>(c)) == std::string_view::npos;
  });
}

bool Allows(const std::string& allowed, const std::string& url) {
  if (!url.starts_with(allowed)) return false;
  if (url.size() == allowed.size() || allowed.ends_with('/')) return true;
  return url[allowed.size()] == '/' || url[allowed.size()] == '?';
}

}  // namespace

void CheckNotifyTarget(const std::string& allowed) {
  if (IsPlainUrl(allowed)) return;
  throw InvalidArgument("--notify-allow '{}' must be http[s]://HOST[:PORT][/PATH]",
                        allowed.substr(0, 200));
}

void CheckNotifyUrl(const std::string& url, const std::vector<std::string>& allowed) {
  if (!IsPlainUrl(url)) {
    throw InvalidArgument(
        "notify_url '{}' must be http[s]://HOST[:PORT][/PATH], at most {} bytes, without a user "
        "and "
        "without '..'",
        url.substr(0, 200),
        kMaxUrlBytes);
  }
  if (std::ranges::any_of(allowed, [&](const auto& one) { return Allows(one, url); })) return;
  throw Error(ErrorCode::kFailedPrecondition,
              "this server may not send word to {}; who runs it allows addresses with "
              "serve --notify-allow",
              url.substr(0, 200));
}

}  // namespace color3d
