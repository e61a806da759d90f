// AWS Signature Version 4 of requests to S3. Stateless.
#pragma once

#include <chrono>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace color3d {

struct S3Key {
  std::string id;
  std::string secret;
  std::string session_token = {};  // empty: none
};

// The parts of a request that its signature covers.
struct S3Request {
  std::string method = "GET";
  std::string path = "/";                                       // not encoded, e.g. "/bucket/key"
  std::vector<std::pair<std::string, std::string>> query = {};  // not encoded
  std::map<std::string, std::string> headers = {};              // by lower-case name
  std::string payload_sha256 = {};
};

// Encodes all bytes but letters, digits, '-', '.', '_' and '~', and '/' if it is kept.
std::string UriEncode(std::string_view text, bool keep_slashes);
// Encoded and in the order of the names, as in the URL.
std::string S3Query(const S3Request& request);
std::string CanonicalS3Request(const S3Request& request);
// "20130524T000000Z"
std::string S3Time(std::chrono::system_clock::time_point time);
// Returns the header Authorization. `time` as S3Time.
std::string S3Authorization(const S3Request& request,
                            const S3Key& key,
                            const std::string& region,
                            const std::string& time);

}  // namespace color3d
