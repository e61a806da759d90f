#include "server/storage/s3/s3_target.h"

#include <algorithm>
#include <charconv>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr char kScheme[] = "s3://";

bool HasOnly(const std::string& text, std::string_view others) {
  return std::ranges::all_of(text, [&](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || others.find(c) != others.npos;
  });
}

constexpr char kUpperCase[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZ";

void ParseBucket(const std::string& blobs, S3Target* target) {
  const auto bad = [&](const std::string& why) {
    return InvalidArgument("--blobs {}: {}; give s3://BUCKET or s3://BUCKET/PREFIX", blobs, why);
  };
  if (!blobs.starts_with(kScheme)) throw bad("it does not begin with s3://");
  const std::string rest = blobs.substr(sizeof(kScheme) - 1);
  const size_t slash = rest.find('/');
  target->bucket = rest.substr(0, slash);
  if (target->bucket.size() < 3 || target->bucket.size() > 63 || !HasOnly(target->bucket, "-.")) {
    throw bad("the bucket must have 3 to 63 lower-case letters, digits, '-' or '.'");
  }
  if (slash == std::string::npos) return;
  std::string prefix = rest.substr(slash + 1);
  while (prefix.ends_with('/')) prefix.pop_back();
  const bool is_good =
      HasOnly(prefix, std::string(kUpperCase) + "-._=/") && prefix.size() <= 500 &&
      !prefix.starts_with('/') && ("/" + prefix + "/").find("/./") == prefix.npos &&
      ("/" + prefix + "/").find("/../") == prefix.npos && prefix.find("//") == prefix.npos;
  if (!is_good) {
    throw bad(
        "the prefix must have at most 500 letters, digits, '-', '.', '_', '=', and single '/'");
  }
  target->prefix = prefix.empty() ? "" : prefix + "/";
}

void ParseEndpoint(const std::string& endpoint, S3Target* target) {
  const auto bad = [&](const std::string& why) {
    return InvalidArgument(
        "--s3-endpoint {}: {}; give https://HOST[:PORT], or http://HOST[:PORT] in a trusted "
        "network",
        endpoint,
        why);
  };
  if (endpoint.empty()) {
    target->host = "s3." + target->region + ".amazonaws.com";
    return;
  }
  const size_t colon = endpoint.find("://");
  target->scheme = endpoint.substr(0, colon);
  if (colon == std::string::npos || (target->scheme != "http" && target->scheme != "https")) {
    throw bad("it begins with neither https:// nor http://");
  }
  std::string host = endpoint.substr(colon + 3);
  if (host.ends_with('/')) host.pop_back();
  if (host.empty() || !HasOnly(host, std::string(kUpperCase) + "-._:[]")) {
    throw bad("only a host and a port may follow");
  }
  const size_t port = host.rfind(':');
  if (port != std::string::npos && host.find(']', port) == std::string::npos) {
    int number = 0;
    const char* end = host.data() + host.size();
    const auto [last, error] = std::from_chars(host.data() + port + 1, end, number);
    if (error != std::errc() || last != end || number < 1 || number > 65'535 || port == 0) {
      throw bad("the port must be 1 to 65535");
    }
    // Clients leave out the scheme's own port in the header Host, which is signed.
    if (number == (target->scheme == "http" ? 80 : 443)) host.erase(port);
  }
  target->host = host;
}

}  // namespace

std::string S3Target::Name() const {
  return "s3://" + bucket + (prefix.empty() ? "" : "/" + prefix.substr(0, prefix.size() - 1));
}

S3Target ParseS3Target(const std::string& blobs,
                       const std::string& endpoint,
                       const std::string& region) {
  S3Target target;
  if (!region.empty()) target.region = region;
  if (!HasOnly(target.region, "-_") || target.region.size() > 60) {
    throw InvalidArgument(
        "--s3-region {}: it must have lower-case letters, digits and '-', e.g. us-east-1",
        target.region);
  }
  ParseBucket(blobs, &target);
  ParseEndpoint(endpoint, &target);
  return target;
}

}  // namespace color3d
