// One notification, signed after the Standard Webhooks specification:
// https://github.com/standard-webhooks/standard-webhooks. Functions are stateless.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>

namespace color3d {

// Reads the signing key: base64 of 24 to 64 bytes, optionally after "whsec_", in a file that only
// its owner can read. Throws Error{kFailedPrecondition} with the command that makes one.
std::string ReadWebhookSecret(const std::filesystem::path& file);

// Returns "v1,BASE64": HMAC-SHA256 over "ID.TIMESTAMP.BODY".
std::string WebhookSignature(const std::string& secret,
                             const std::string& id,
                             int64_t timestamp_s,
                             const std::string& body);

struct WebhookMessage {
  std::string url;
  std::string id;  // the same for each try
  int64_t timestamp_s = 0;
  std::string body;  // JSON
};

struct WebhookAnswer {
  int status = 0;       // HTTP status; 0: no answer
  std::string problem;  // why there was no answer
};

// Takes at most 10 s, less once `stop` is set. Follows no redirects, uses no proxy, and reads at
// most 64 KiB of the answer.
WebhookAnswer SendWebhook(const WebhookMessage& message,
                          const std::string& secret,
                          const std::atomic<bool>& stop);

}  // namespace color3d
