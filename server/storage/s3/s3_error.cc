#include "server/storage/s3/s3_error.h"

#include <curl/curl.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <string_view>

#include "server/storage/s3/s3_xml.h"

namespace color3d {
namespace {

struct Remedy {
  std::string_view code, text;
};

constexpr std::array<Remedy, 16> kRemedies{{
    {"NoSuchBucket", "create the bucket, or correct --blobs and --s3-endpoint"},
    {"AccessDenied",
     "allow the key of --s3-credentials-file s3:GetObject, s3:PutObject, s3:DeleteObject, "
     "s3:AbortMultipartUpload, s3:ListBucket and s3:ListBucketMultipartUploads on this bucket and "
     "prefix"},
    {"AllAccessDisabled", "the store has closed this bucket; ask its operator"},
    {"AccountProblem", "the store has a problem with the account of the key; ask its operator"},
    {"InvalidAccessKeyId", "the store does not know access_key_id of --s3-credentials-file"},
    {"SignatureDoesNotMatch",
     "secret_access_key of --s3-credentials-file does not belong to its access_key_id"},
    {"RequestTimeTooSkewed", "set the clock of this machine, e.g. by NTP"},
    {"ExpiredToken", "write new temporary keys to --s3-credentials-file; it is read again"},
    {"InvalidToken", "correct session_token of --s3-credentials-file"},
    {"AuthorizationHeaderMalformed", "correct --s3-region"},
    {"IllegalLocationConstraintException", "correct --s3-region"},
    {"PermanentRedirect", "the bucket has another endpoint; correct --s3-endpoint and --s3-region"},
    {"QuotaExceeded", "free some space in the store, or raise the quota"},
    {"XMinioStorageFull", "free some space in the store"},
    {"InsufficientStorage", "free some space in the store"},
    {"SlowDown", "the store asks for fewer requests; try again later"},
}};

// How far this machine's clock is ahead of the store's, by the header Date; empty if unknown.
std::string ClockDifference(const HttpAnswer& answer) {
  const int64_t theirs = ParseS3Time(answer.Header("date"));
  if (theirs == 0) return "";
  const int64_t ahead = static_cast<int64_t>(std::time(nullptr)) - theirs;
  return fmt::format(" (it is {} s {} the store's)",
                     ahead < 0 ? -ahead : ahead,
                     ahead < 0 ? "behind" : "ahead of");
}

std::string RemedyFor(const S3Target& target, const HttpAnswer& answer, const std::string& code) {
  const auto known = std::ranges::find(kRemedies, std::string_view(code), &Remedy::code);
  std::string remedy = known == kRemedies.end() ? "" : std::string(known->text);
  if (code == "RequestTimeTooSkewed") remedy += ClockDifference(answer);
  const std::string region = XmlText(answer.text, "Region");
  if (code == "AuthorizationHeaderMalformed" && !region.empty()) {
    return fmt::format("the bucket is in the region {}: give --s3-region {}", region, region);
  }
  const std::string endpoint = XmlText(answer.text, "Endpoint");
  if (code == "PermanentRedirect" && !endpoint.empty()) {
    return fmt::format("the bucket has the endpoint {}: correct --s3-endpoint and --s3-region",
                       endpoint);
  }
  if (remedy.empty() && answer.status == 0) {
    return fmt::format("check --s3-endpoint {}, the network{}",
                       target.Endpoint(),
                       target.scheme == "https" ? " and the certificate (--s3-ca)" : "");
  }
  return remedy.empty() ? "see the log of the object store" : remedy;
}

}  // namespace

int64_t ParseS3Time(const std::string& text) {
  std::tm utc{};
  const char* end = ::strptime(text.c_str(), "%Y-%m-%dT%H:%M:%S", &utc);
  if (end != nullptr) return static_cast<int64_t>(::timegm(&utc));
  return std::max<int64_t>(0, curl_getdate(text.c_str(), nullptr));
}

std::string S3CodeOf(const HttpAnswer& answer) {
  const std::string code = XmlText(answer.text, "Code");
  if (!code.empty()) return code;
  switch (answer.status) {
    case 301:
      return "PermanentRedirect";
    case 403:
      return "AccessDenied";
    case 404:
      return "NotFound";
    case 412:
      return "PreconditionFailed";
    case 503:
      return "SlowDown";
    case 507:
      return "InsufficientStorage";
    default:
      return "";
  }
}

bool IsWorthRetry(const HttpAnswer& answer) {
  const std::string code = S3CodeOf(answer);
  switch (answer.status) {
    case 0:
      return answer.is_worth_retry;
    case 200:  // with an error as its body
    case 206:
      return answer.is_worth_retry || code == "InternalError" || code == "SlowDown" ||
             code == "ServiceUnavailable";
    case 400:
      return code == "RequestTimeout" || code == "IncompleteBody";
    case 408:
    case 429:
    case 500:
    case 502:
    case 503:
    case 504:
      return true;
    case 409:
      return code == "ConditionalRequestConflict" || code == "OperationAborted";
    default:
      return false;
  }
}

S3Error MakeS3Error(const S3Target& target, const std::string& what, const HttpAnswer& answer) {
  const std::string code = S3CodeOf(answer);
  const std::string told = XmlText(answer.text, "Message");
  const bool has_status = answer.status >= 300 || (answer.failure.empty() && answer.status > 0);
  std::string problem = has_status
                            ? fmt::format("{}{}{}", answer.status, code.empty() ? "" : " ", code)
                            : answer.failure;
  if (has_status && !told.empty()) problem += " (" + told.substr(0, 300) + ")";
  return S3Error(fmt::format("{}: {}; {}", what, problem, RemedyFor(target, answer, code)),
                 answer.status,
                 code);
}

}  // namespace color3d
