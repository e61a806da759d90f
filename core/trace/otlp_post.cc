#include "core/trace/otlp_post.h"

#include <curl/curl.h>

#include <algorithm>
#include <memory>

namespace color3d {
namespace {

constexpr long kConnectMs = 5'000;
constexpr size_t kMaxAnswer = 64 << 10;

// Delay until a stop is noticed.
constexpr int kTickMs = 50;

struct Release {
  void operator()(CURL* curl) const { curl_easy_cleanup(curl); }
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};
struct ReleaseMulti {  // CURL and CURLM are the same type
  void operator()(CURLM* curl) const { curl_multi_cleanup(curl); }
};

size_t CountAnswer(char*, size_t size, size_t count, void* seen) {
  *static_cast<size_t*>(seen) += size * count;
  return *static_cast<size_t*>(seen) > kMaxAnswer ? 0 : size * count;
}

// curl_easy_perform would notice a stop only once a second.
CURLcode Perform(CURL* curl, const std::atomic<bool>& stop) {
  const std::unique_ptr<CURLM, ReleaseMulti> multi(curl_multi_init());
  if (!multi || curl_multi_add_handle(multi.get(), curl) != CURLM_OK) return CURLE_FAILED_INIT;
  CURLcode code = CURLE_ABORTED_BY_CALLBACK;
  for (int running = 1; !stop.load();) {
    CURLMcode state = curl_multi_perform(multi.get(), &running);
    if (state == CURLM_OK && running > 0) {
      state = curl_multi_poll(multi.get(), nullptr, 0, kTickMs, nullptr);
    }
    if (state != CURLM_OK) {
      code = CURLE_FAILED_INIT;
      break;
    }
    if (running > 0) continue;
    int left = 0;
    if (const CURLMsg* done = curl_multi_info_read(multi.get(), &left)) code = done->data.result;
    break;
  }
  curl_multi_remove_handle(multi.get(), curl);
  return code;
}

}  // namespace

TraceAnswer PostTraces(const TraceTarget& target,
                       const std::string& json,
                       const std::atomic<bool>& stop) {
  TraceAnswer answer;
  const std::unique_ptr<CURL, Release> handle(curl_easy_init());
  CURL* curl = handle.get();
  if (curl == nullptr) {
    answer.problem = "libcurl cannot be initialized";
    return answer;
  }
  std::unique_ptr<curl_slist, Release> headers;
  const auto add = [&headers](const std::string& header) {
    headers.reset(curl_slist_append(headers.release(), header.c_str()));
  };
  add("Content-Type: application/json");
  add("Expect:");
  for (const auto& [name, value] : target.headers) add(name + ": " + value);
  size_t seen = 0;
  const long limit_ms = std::max(1L, static_cast<long>(target.limit.count()));
  curl_easy_setopt(curl, CURLOPT_URL, target.url.c_str());
  curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(curl, CURLOPT_FOLLOWLOCATION, 0L);
  curl_easy_setopt(curl, CURLOPT_PROXY, "");
  curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT_MS, std::min(limit_ms, kConnectMs));
  curl_easy_setopt(curl, CURLOPT_TIMEOUT_MS, limit_ms);
  curl_easy_setopt(curl, CURLOPT_USERAGENT, "color3d");
  if (!target.certificate.empty()) {
    curl_easy_setopt(curl, CURLOPT_CAINFO, target.certificate.c_str());
  }
  curl_easy_setopt(curl, CURLOPT_HTTPHEADER, headers.get());
  curl_easy_setopt(curl, CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(json.size()));
  curl_easy_setopt(curl, CURLOPT_POSTFIELDS, json.c_str());
  curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, CountAnswer);
  curl_easy_setopt(curl, CURLOPT_WRITEDATA, &seen);
  curl_easy_setopt(curl, CURLOPT_QUICK_EXIT, 1L);  // does not wait for a resolver of names
  const CURLcode code = Perform(curl, stop);
  // A long answer is cut; only its status counts.
  if (code != CURLE_OK && code != CURLE_WRITE_ERROR) {
    answer.problem = curl_easy_strerror(code);
    return answer;
  }
  long status = 0;
  curl_easy_getinfo(curl, CURLINFO_RESPONSE_CODE, &status);
  answer.status = static_cast<int>(status);
  curl_off_t retry_after_s = 0;  // also of a date
  curl_easy_getinfo(curl, CURLINFO_RETRY_AFTER, &retry_after_s);
  answer.retry_after = std::chrono::seconds(std::clamp<curl_off_t>(retry_after_s, 0, 3600));
  return answer;
}

}  // namespace color3d
