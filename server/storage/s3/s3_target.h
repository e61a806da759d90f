// Where the objects of a store are: endpoint, bucket and prefix. A plain value.
#pragma once

#include <filesystem>
#include <string>

namespace color3d {

struct S3Target {
  std::string scheme = "https";
  std::string host;  // with ":PORT" unless it is the scheme's own
  std::string bucket;
  std::string prefix;  // empty, or ends with '/'
  std::string region = "us-east-1";
  std::filesystem::path authorities = {};  // PEM file; empty: those of the system

  std::string Endpoint() const { return scheme + "://" + host; }
  // "s3://BUCKET[/PREFIX]".
  std::string Name() const;
};

// Parses "s3://BUCKET[/PREFIX]" and "http[s]://HOST[:PORT]"; an empty endpoint is Amazon's of the
// region. Throws Error{kInvalidArgument} naming the flag of `serve`.
S3Target ParseS3Target(const std::string& blobs,
                       const std::string& endpoint,
                       const std::string& region);

}  // namespace color3d
