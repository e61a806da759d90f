#include "server/storage/s3/s3_check.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <random>

namespace color3d {
namespace {

// A store that cannot be reached is reported soon.
constexpr int kCheckTries = 3;
constexpr char kCheckedBytes[] = "color3d reads and writes here\n";
constexpr char kOwnerKey[] = "owner";

S3Options ForCheck(S3Options options) {
  options.timing.tries = std::min(options.timing.tries, kCheckTries);
  return options;
}

// Calls `body`; failures that only the operator can mend get another code.
template <typename Body>
auto Checking(const S3Target& target, const char* what, const Body& body) {
  try {
    return body();
  } catch (const S3Error& e) {
    const bool may_pass = e.status() == 0 || e.status() == 429 || e.status() >= 500;
    throw Error(may_pass ? ErrorCode::kUnavailable : ErrorCode::kFailedPrecondition,
                "cannot {} {}: {}",
                what,
                target.Name(),
                e.what());
  }
}

}  // namespace

void CheckBucket(const S3Options& given) {
  const S3Options options = ForCheck(given);
  const S3Target& target = options.target;
  S3Client client(options);
  std::random_device random;
  const std::string key = fmt::format("check-{:08x}{:08x}", random(), random());
  Checking(target, "write to", [&] { client.PutBytes(key, kCheckedBytes, S3Replace::kNo); });
  const std::optional<std::string> read =
      Checking(target, "read from", [&] { return client.GetBytes(key); });
  const bool has_condition = Checking(target, "write to", [&] {
    return !client.PutBytes(key, kCheckedBytes, S3Replace::kNo).has_value();
  });
  bool is_listed = false;
  Checking(target, "list", [&] {
    client.List(key, [&](const S3Object& object) {
      is_listed |= object.key == key;
      return !is_listed;
    });
  });
  Checking(target, "remove from", [&] { client.Delete(key); });
  if (read != kCheckedBytes || !is_listed || client.Head(key)) {
    throw Error(ErrorCode::kFailedPrecondition,
                "{} at {} does not show at once what was written or removed; --blobs requires a "
                "store that is strongly consistent, without a cache before it",
                target.Name(),
                target.Endpoint());
  }
  if (!has_condition) {
    spdlog::warn(
        "{} does not know conditional writes (If-None-Match): several servers must not share it",
        target.Endpoint());
  }
}

void ClaimBucket(const S3Options& given, const std::string& store) {
  const S3Options options = ForCheck(given);
  const S3Target& target = options.target;
  S3Client client(options);
  Checking(target, "write to", [&] { client.PutBytes(kOwnerKey, store, S3Replace::kNo); });
  const std::optional<std::string> owner =
      Checking(target, "read from", [&] { return client.GetBytes(kOwnerKey); });
  if (owner == store) return;
  throw Error(ErrorCode::kFailedPrecondition,
              "{} has the blobs of another store of jobs ({}; this one is {}), whose server would "
              "remove those of this one: give another prefix in --blobs, or, if the jobs have "
              "moved here for good, remove the object '{}owner'",
              target.Name(),
              owner.value_or("unknown").substr(0, 200),
              store,
              target.prefix);
}

}  // namespace color3d
