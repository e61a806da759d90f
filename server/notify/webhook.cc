#include "server/notify/webhook.h"

#include <curl/curl.h>
#include <fmt/format.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <sys/stat.h>

#include <array>
#include <memory>
#include <string_view>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/text/base64.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr long kLimitMs = 10'000;
constexpr long kConnectLimitMs = 5'000;
constexpr size_t kMaxAnswerBytes = 64 << 10;
constexpr std::string_view kSecretPrefix = "whsec_";

Error BadSecret(const fs::path& file, const std::string& what) {
  return Error(ErrorCode::kFailedPrecondition,
               "--notify-secret {}: {}; make one with: (umask 077; openssl rand -base64 32 > {})",
               file.string(),
               what,
               file.string());
}

struct CurlDeleter {
  void operator()(CURL* curl) const { curl_easy_cleanup(curl); }
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};

size_t Discard(char*, size_t size, size_t count, void* seen) {
  *static_cast<size_t*>(seen) += size * count;
  return *static_cast<size_t*>(seen) > kMaxAnswerBytes ? 0 : size * count;
}

int StopOnRequest(void* stop, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
  return static_cast<const std::atomic<bool>*>(stop)->load() ? 1 : 0;
}

}  // namespace

std::string ReadWebhookSecret(const fs::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) throw BadSecret(file, "there is no such file");
  if ((status.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    throw BadSecret(file, "it is accessible by others than its owner (run chmod 600)");
  }
  std::string text = ReadFile(file, 4096);
  text.erase(text.find_last_not_of(" \t\r\n") + 1);
  if (text.starts_with(kSecretPrefix)) text.erase(0, kSecretPrefix.size());
  std::string bytes(text.size(), '\0');
  const int decoded = text.size() % 4 == 0
                          ? EVP_DecodeBlock(reinterpret_cast<unsigned char*>(bytes.data()),
                                            reinterpret_cast<const unsigned char*>(text.data()),
                                            static_cast<int>(text.size()))
                          : -1;
  if (decoded < 0) throw BadSecret(file, "it is not valid base64");
  const size_t padding = text.ends_with("==") ? 2 : text.ends_with('=') ? 1 : 0;
  bytes.resize(static_cast<size_t>(decoded) - padding);
  if (bytes.size() < 24 || bytes.size() > 64) {
    throw BadSecret(file, fmt::format("it has {} bytes; 24 to 64 are required", bytes.size()));
  }
  return bytes;
}

std::string WebhookSignature(const std::string& secret,
                             const std::string& id,
                             int64_t timestamp_s,
                             const std::string& body) {
  const std::string text = fmt::format("{}.{}.{}", id, timestamp_s, body);
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest;
  unsigned int size = 0;
  HMAC(EVP_sha256(),
       secret.data(),
       static_cast<int>(secret.size()),
       reinterpret_cast<const unsigned char*>(text.data()),
       text.size(),
       digest.data(),
       &size);
  return "v1," + Base64({reinterpret_cast<const char*>(digest.data()), size});
}

WebhookAnswer SendWebhook(const WebhookMessage& message,
                          const std::string& secret,
                          const std::atomic<bool>& stop) {
  const std::unique_ptr<CURL, CurlDeleter> handle(curl_easy_init());
  CURL* curl = handle.get();
  if (curl == nullptr) return {0, "libcurl cannot be initialized"};
  std::unique_ptr<curl_slist, CurlDeleter> headers;
  for (const std::string& header :
       {std::string("Content-Type: application/json"),
        std::string("Expect:"),
        "webhook-id: " + message.id,
        fmt::format("webhook-timestamp: {}", message.timestamp_s),
        "webhook-signature: " +
            WebhookSignature(secret, message.id, message.timestamp_s, message.body)}) {
    headers.reset(curl_slist_append(headers.release(), header.c_str()));
  }
  size_t seen = 0;
  curl_easy_setopt(curl, CURLOPT_URL, message.url.c_str());
  curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(curl, CURLOPT_FOLLOWLOCATION, 0L);
  curl_easy_setopt(curl, CURLOPT_PROXY, "");
  curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT_MS, kConnectLimitMs);
  curl_easy_setopt(curl, CURLOPT_TIMEOUT_MS, kLimitMs);
  curl_easy_setopt(curl, CURLOPT_USERAGENT, "color3d-server");
  curl_easy_setopt(curl, CURLOPT_HTTPHEADER, headers.get());
  curl_easy_setopt(curl, CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(message.body.size()));
  curl_easy_setopt(curl, CURLOPT_POSTFIELDS, message.body.c_str());
  curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, Discard);
  curl_easy_setopt(curl, CURLOPT_WRITEDATA, &seen);
  curl_easy_setopt(curl, CURLOPT_NOPROGRESS, 0L);
  curl_easy_setopt(curl, CURLOPT_XFERINFOFUNCTION, StopOnRequest);
  curl_easy_setopt(curl, CURLOPT_XFERINFODATA, &stop);
  const CURLcode code = curl_easy_perform(curl);
  long status = 0;
  curl_easy_getinfo(curl, CURLINFO_RESPONSE_CODE, &status);
  // A long answer is truncated; only its status counts.
  if (code != CURLE_OK && code != CURLE_WRITE_ERROR) return {0, curl_easy_strerror(code)};
  return {static_cast<int>(status), ""};
}

}  // namespace color3d
