#include "server/storage/s3/http_pool.h"

#include <curl/curl.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <exception>
#include <utility>

#include "core/base/error.h"
#include "core/base/text/address.h"

namespace color3d {
namespace {

constexpr int64_t kLargeBytes = 1 << 20;
constexpr size_t kMaxErrorBytes = 64 << 10;
constexpr size_t kMaxTextBytes = 16 << 20;

struct CurlDeleter {
  void operator()(CURL* curl) const { curl_easy_cleanup(curl); }
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};
using CurlHandle = std::unique_ptr<CURL, CurlDeleter>;

// A call under way, for the callbacks.
struct Transfer {
  const HttpCall& call;
  HttpAnswer answer;
  const std::atomic<bool>& stopped;
  CURL* curl = nullptr;
  int64_t sent = 0;
  std::exception_ptr exception;
};

size_t TakeHeader(char* line, size_t size, size_t count, void* context) {
  auto& transfer = *static_cast<Transfer*>(context);
  const std::string_view text(line, size * count);
  if (text.starts_with("HTTP/")) transfer.answer.headers.clear();  // after "100 Continue"
  const size_t colon = text.find(':');
  if (colon == text.npos) return size * count;
  std::string name(text.substr(0, colon));
  std::ranges::transform(
      name, name.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const size_t begin = text.find_first_not_of(" \t", colon + 1);
  const size_t end = text.find_last_not_of(" \t\r\n");
  transfer.answer.headers[name] =
      begin == text.npos || end < begin ? "" : std::string(text.substr(begin, end - begin + 1));
  return size * count;
}

size_t TakeBody(char* data, size_t size, size_t count, void* context) {
  auto& transfer = *static_cast<Transfer*>(context);
  const std::string_view bytes(data, size * count);
  long status = 0;
  curl_easy_getinfo(transfer.curl, CURLINFO_RESPONSE_CODE, &status);
  const bool is_good = status / 100 == 2;
  if (!is_good || !transfer.call.sink) {
    const size_t most = is_good ? kMaxTextBytes : kMaxErrorBytes;
    if (transfer.answer.text.size() + bytes.size() > most) return 0;
    transfer.answer.text.append(bytes);
    return bytes.size();
  }
  try {
    transfer.call.sink(bytes);
  } catch (...) {
    transfer.exception = std::current_exception();
    return 0;
  }
  return bytes.size();
}

size_t GiveBody(char* buffer, size_t size, size_t count, void* context) {
  auto& transfer = *static_cast<Transfer*>(context);
  const auto left = static_cast<size_t>(transfer.call.body_bytes - transfer.sent);
  const size_t most = std::min(size * count, left);
  if (most == 0) return 0;
  try {
    const size_t given = transfer.call.body(transfer.sent, buffer, most);
    transfer.sent += static_cast<int64_t>(given);
    return given;
  } catch (...) {
    transfer.exception = std::current_exception();
    return CURL_READFUNC_ABORT;
  }
}

// A kept connection may turn out to be closed after the body was begun.
int SeekBody(void* context, curl_off_t offset, int origin) {
  if (origin != SEEK_SET) return CURL_SEEKFUNC_CANTSEEK;
  static_cast<Transfer*>(context)->sent = offset;
  return CURL_SEEKFUNC_OK;
}

int StopTransfer(void* context, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
  return static_cast<Transfer*>(context)->stopped.load() ? 1 : 0;
}

// Failures that another try cannot change.
bool IsPermanent(CURLcode code) {
  switch (code) {
    case CURLE_UNSUPPORTED_PROTOCOL:
    case CURLE_URL_MALFORMAT:
    case CURLE_PEER_FAILED_VERIFICATION:
    case CURLE_SSL_CACERT_BADFILE:
    case CURLE_ABORTED_BY_CALLBACK:
    case CURLE_FILESIZE_EXCEEDED:
      return true;
    default:
      return false;
  }
}

bool IsOnThisMachine(const std::string& url) {
  const size_t begin = url.find("://") + 3;
  const std::string host = url.substr(begin, url.find('/', begin) - begin);
  const bool has_port = host.rfind(':') != host.npos && !host.ends_with(']');
  return IsLoopback(has_port ? host : host + ":80");
}

}  // namespace

struct HttpPool::Connections {
  Mutex mutex;
  std::vector<CurlHandle> idle COLOR3D_GUARDED_BY(mutex);

  CurlHandle Take() {
    const MutexLock lock(mutex);
    if (idle.empty()) return CurlHandle(curl_easy_init());
    CurlHandle handle = std::move(idle.back());
    idle.pop_back();
    return handle;
  }
  void GiveBack(CurlHandle handle) {
    curl_easy_reset(handle.get());  // keeps the connection
    const MutexLock lock(mutex);
    idle.push_back(std::move(handle));
  }
};

HttpPool::HttpPool(std::filesystem::path authorities, std::chrono::milliseconds connect_limit)
    : authorities_(std::move(authorities)),
      connect_limit_(connect_limit),
      connections_(std::make_unique<Connections>()) {
  static const CURLcode initialized = curl_global_init(CURL_GLOBAL_DEFAULT);
  if (initialized != CURLE_OK) throw Error(ErrorCode::kInternal, "libcurl cannot be initialized");
}

HttpPool::~HttpPool() = default;

void HttpPool::Stop() {
  {
    const MutexLock lock(mutex_);
    stopped_ = true;
  }
  wake_.NotifyAll();
}

bool HttpPool::Pause(std::chrono::milliseconds time) {
  const auto end = std::chrono::steady_clock::now() + time;
  const MutexLock lock(mutex_);
  while (!stopped_ && wake_.WaitUntil(mutex_, end)) {
  }
  return !stopped_;
}

HttpAnswer HttpPool::Call(const HttpCall& call) {
  CurlHandle handle = connections_->Take();
  CURL* const curl = handle.get();
  if (curl == nullptr) throw Error(ErrorCode::kInternal, "libcurl cannot be initialized");
  Transfer transfer{call, {}, stopped_, curl, 0, nullptr};
  std::unique_ptr<curl_slist, CurlDeleter> headers;
  for (const std::string& header : call.headers) {
    headers.reset(curl_slist_append(headers.release(), header.c_str()));
  }
  // The store may refuse a large body before it is sent; for a small one that is a way more.
  if (call.body_bytes >= 0 && call.body_bytes < kLargeBytes) {
    headers.reset(curl_slist_append(headers.release(), "Expect:"));
  }
  const auto set = [curl](CURLoption option, auto value) { curl_easy_setopt(curl, option, value); };
  set(CURLOPT_URL, call.url.c_str());
  set(CURLOPT_CUSTOMREQUEST, call.method.c_str());
  set(CURLOPT_NOSIGNAL, 1L);
  set(CURLOPT_PROTOCOLS_STR, "http,https");
  set(CURLOPT_HTTP_VERSION, static_cast<long>(CURL_HTTP_VERSION_1_1));
  set(CURLOPT_HTTPHEADER, headers.get());
  set(CURLOPT_PATH_AS_IS, 1L);
  set(CURLOPT_CONNECTTIMEOUT_MS, static_cast<long>(connect_limit_.count()));
  set(CURLOPT_LOW_SPEED_LIMIT, 1L);
  set(CURLOPT_LOW_SPEED_TIME, static_cast<long>(call.stall.count()));
  set(CURLOPT_TCP_KEEPALIVE, 1L);
  if (!authorities_.empty()) set(CURLOPT_CAINFO, authorities_.c_str());
  if (IsOnThisMachine(call.url)) set(CURLOPT_PROXY, "");
  if (call.method == "HEAD") set(CURLOPT_NOBODY, 1L);
  if (call.body_bytes >= 0) {
    set(CURLOPT_UPLOAD, 1L);
    set(CURLOPT_INFILESIZE_LARGE, static_cast<curl_off_t>(call.body_bytes));
    set(CURLOPT_READFUNCTION, GiveBody);
    set(CURLOPT_READDATA, &transfer);
    set(CURLOPT_SEEKFUNCTION, SeekBody);
    set(CURLOPT_SEEKDATA, &transfer);
  }
  set(CURLOPT_HEADERFUNCTION, TakeHeader);
  set(CURLOPT_HEADERDATA, &transfer);
  set(CURLOPT_WRITEFUNCTION, TakeBody);
  set(CURLOPT_WRITEDATA, &transfer);
  set(CURLOPT_NOPROGRESS, 0L);
  set(CURLOPT_XFERINFOFUNCTION, StopTransfer);
  set(CURLOPT_XFERINFODATA, &transfer);
  std::array<char, CURL_ERROR_SIZE> why{};
  set(CURLOPT_ERRORBUFFER, why.data());
  const CURLcode code = stopped_ ? CURLE_ABORTED_BY_CALLBACK : curl_easy_perform(curl);
  long status = 0;
  curl_easy_getinfo(curl, CURLINFO_RESPONSE_CODE, &status);
  if (transfer.exception) std::rethrow_exception(transfer.exception);
  HttpAnswer& answer = transfer.answer;
  answer.status = status < 200 ? 0 : static_cast<int>(status);  // 100: "Continue" was no answer
  if (code != CURLE_OK) {
    answer.failure = code == CURLE_ABORTED_BY_CALLBACK ? "the server is shutting down"
                     : why[0] != '\0'                  ? why.data()
                                                       : curl_easy_strerror(code);
    answer.is_worth_retry = !IsPermanent(code);
  }
  connections_->GiveBack(std::move(handle));
  return std::move(transfer.answer);
}

}  // namespace color3d
