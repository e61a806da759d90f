// One word to somebody's address, signed after the Standard Webhooks specification:
// https://github.com/standard-webhooks/standard-webhooks. Functions are stateless.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>

namespace color3d {

// The key of signatures: base64 of 24 to 64 bytes, "whsec_" before it or not, in a file that only
// its owner can read. Throws Error{kFailedPrecondition} that says how to make one.
std::string ReadWebhookSecret(const std::filesystem::path& file);

// "v1,BASE64": HMAC-SHA256 with the secret over "ID.TIMESTAMP.BODY".
std::string WebhookSignature(const std::string& secret,
                             const std::string& id,
                             int64_t timestamp_s,
                             const std::string& body);

struct WebhookMessage {
  std::string url;
  std::string id;  // the same at each try
  int64_t timestamp_s = 0;
  std::string body;  // JSON
};

struct WebhookAnswer {
  int status = 0;       // of HTTP; 0: there was none
  std::string problem;  // why there was none
};

// Takes 10 s at most, less when `stop` is set. Follows nobody elsewhere, uses no proxy, and reads
// 64 KiB of the answer at most.
WebhookAnswer SendWebhook(const WebhookMessage& message,
                          const std::string& secret,
                          const std::atomic<bool>& stop);

}  // namespace color3d
