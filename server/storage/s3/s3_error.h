// What an object store refused or failed to do, with the remedy. Immutable; thrown by value.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "core/base/error.h"
#include "server/storage/s3/http_pool.h"
#include "server/storage/s3/s3_target.h"

namespace color3d {

class S3Error : public Error {
 public:
  // kUnavailable if it may pass by itself or if the operator can mend it without a restart.
  S3Error(const std::string& message, int status, std::string code)
      : Error(ErrorCode::kUnavailable, message), status_(status), s3_code_(std::move(code)) {}
  int status() const { return status_; }                   // of HTTP; 0: no answer
  const std::string& s3_code() const { return s3_code_; }  // e.g. "NoSuchBucket"; may be empty

 private:
  int status_;
  std::string s3_code_;
};

// The code in an error's XML, or that of its status where the answer has no body (HEAD).
std::string S3CodeOf(const HttpAnswer& answer);
// Parses the times of headers ("Sat, 28 Nov 2026 01:00:00 GMT") and of XML
// ("2026-11-28T01:00:00.000Z"); returns s since 1970, or 0 if it is neither.
int64_t ParseS3Time(const std::string& text);
// Returns true if the same request may succeed later.
bool IsWorthRetry(const HttpAnswer& answer);
// `what`: the request, e.g. "PUT s3://bucket/key".
S3Error MakeS3Error(const S3Target& target, const std::string& what, const HttpAnswer& answer);

}  // namespace color3d
