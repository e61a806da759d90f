#include "server/storage/s3/s3_client.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <random>
#include <utility>

#include "core/base/digest.h"
#include "server/storage/s3/s3_xml.h"

namespace color3d {
namespace {

constexpr int kMaxRetryAfterSeconds = 30;

double RandomHalfToOne() {
  thread_local std::minstd_rand random{std::random_device{}()};
  return std::uniform_real_distribution<double>(0.5, 1.0)(random);
}

bool IsAnswer(const HttpAnswer& answer, const std::vector<int>& expected) {
  if (std::ranges::find(expected, answer.status) != expected.end()) return true;
  return answer.failure.empty() && answer.status / 100 == 2;
}

}  // namespace

S3Source BytesSource(std::string_view bytes) {
  return [bytes](int64_t offset, char* buffer, size_t size) {
    const std::string_view part = bytes.substr(static_cast<size_t>(offset), size);
    std::memcpy(buffer, part.data(), part.size());
    return part.size();
  };
}

S3Client::S3Client(S3Options options)
    : options_(std::move(options)), http_(options_.target.authorities, options_.timing.connect) {}

S3Request S3Client::RequestFor(const std::string& method, const std::string& key) const {
  const S3Target& target = options_.target;
  S3Request request;
  request.method = method;
  request.path = "/" + target.bucket + (key.empty() ? "" : "/" + target.prefix + key);
  request.payload_sha256 = Sha256Hex("");
  return request;
}

std::string S3Client::NameOf(const Ask& ask) const {
  const S3Target& target = options_.target;
  return fmt::format("{} s3://{}/{}{} at {}",
                     ask.request.method,
                     target.bucket,
                     target.prefix,
                     ask.key,
                     target.Endpoint());
}

HttpAnswer S3Client::Once(const Ask& ask) {
  S3Request request = ask.request;
  const S3Key key = options_.key();
  const std::string time = S3Time(std::chrono::system_clock::now());
  if (ask.body != nullptr) request.payload_sha256 = ask.body->sha256;
  request.headers["host"] = options_.target.host;
  request.headers["x-amz-content-sha256"] = request.payload_sha256;
  request.headers["x-amz-date"] = time;
  if (!key.session_token.empty()) request.headers["x-amz-security-token"] = key.session_token;
  HttpCall call;
  call.method = request.method;
  call.url = options_.target.Endpoint() + UriEncode(request.path, true);
  if (const std::string query = S3Query(request); !query.empty()) call.url += "?" + query;
  for (const auto& [name, value] : request.headers) call.headers.push_back(name + ": " + value);
  call.headers.push_back("Authorization: " +
                         S3Authorization(request, key, options_.target.region, time));
  call.headers.emplace_back("Accept:");
  call.headers.emplace_back("Content-Type:");
  call.sink = ask.sink;
  call.stall = ask.stall.count() > 0 ? ask.stall : options_.timing.stall;
  if (ask.body != nullptr) {
    call.body_bytes = ask.body->bytes;
    call.body = [&body = *ask.body](int64_t offset, char* buffer, size_t size) {
      return body.source(body.offset + offset, buffer, size);
    };
  }
  HttpAnswer answer = http_.Call(call);
  if (const int64_t told = ParseS3Time(answer.Header("date")); told > 0) store_time_ = told;
  if (ask.may_fail_within && answer.status == 200 && answer.failure.empty() &&
      !XmlElements(answer.text, "Error").empty()) {
    answer.failure = S3CodeOf(answer) + " (" + XmlText(answer.text, "Message") + ")";
  }
  return answer;
}

bool S3Client::PauseBefore(int done, const HttpAnswer& answer) {
  if (done >= options_.timing.tries || !IsWorthRetry(answer)) return false;
  const auto longest = std::min<double>(
      static_cast<double>(options_.timing.max_pause.count()),
      static_cast<double>(options_.timing.first_pause.count()) * std::pow(2.0, done - 1));
  int64_t pause = static_cast<int64_t>(longest * RandomHalfToOne());
  const int asked = std::atoi(answer.Header("retry-after").c_str());
  pause = std::max<int64_t>(pause, std::clamp(asked, 0, kMaxRetryAfterSeconds) * 1000);
  return http_.Pause(std::chrono::milliseconds(pause));
}

HttpAnswer S3Client::Send(const Ask& ask) {
  for (int done = 1;; ++done) {
    HttpAnswer answer = Once(ask);
    if (IsAnswer(answer, ask.expected)) return answer;
    if (!PauseBefore(done, answer)) throw MakeS3Error(options_.target, NameOf(ask), answer);
    spdlog::debug("{}: {} {}; try {}", NameOf(ask), answer.status, answer.failure, done + 1);
  }
}

std::optional<S3Object> S3Client::Head(const std::string& key) {
  const HttpAnswer answer = Send({RequestFor("HEAD", key), key, nullptr, {}, {}, {404}});
  if (answer.status == 404) return std::nullopt;
  S3Object object;
  object.key = key;
  object.size_bytes = std::strtoll(answer.Header("content-length").c_str(), nullptr, 10);
  object.etag = answer.Header("etag");
  object.modified = answer.Header("last-modified");
  return object;
}

bool S3Client::Get(const std::string& key,
                   int64_t offset,
                   int64_t size_bytes,
                   const std::function<void(std::string_view)>& sink) {
  if (size_bytes <= 0) return Head(key).has_value();
  int64_t received = 0, before = 0;
  Ask ask{RequestFor("GET", key), key};
  ask.sink = [&](std::string_view bytes) {
    bytes = bytes.substr(0, static_cast<size_t>(size_bytes - received));
    sink(bytes);
    received += static_cast<int64_t>(bytes.size());
  };
  for (int done = 1;; ++done) {
    ask.request.headers["range"] =
        fmt::format("bytes={}-{}", offset + received, offset + size_bytes - 1);
    HttpAnswer answer = Once(ask);
    if (answer.status == 404 && S3CodeOf(answer) != "NoSuchBucket") return false;
    if (received == size_bytes) return true;
    if (answer.failure.empty() && answer.status / 100 == 2) {
      answer.failure = fmt::format(
          "the object ended after {} of {} bytes", offset + received, offset + size_bytes);
      answer.is_worth_retry = true;
    }
    if (received > before) done = 1;
    before = received;
    if (!PauseBefore(done, answer)) throw MakeS3Error(options_.target, NameOf(ask), answer);
  }
}

std::optional<std::string> S3Client::GetBytes(const std::string& key) {
  HttpAnswer answer = Send({RequestFor("GET", key), key, nullptr, {}, {}, {404}});
  if (answer.status != 404) return answer.text;
  if (S3CodeOf(answer) == "NoSuchBucket") {
    throw MakeS3Error(options_.target, "GET " + options_.target.Name() + "/" + key, answer);
  }
  return std::nullopt;
}

bool S3Client::Delete(const std::string& key, const std::string& only_with_etag) {
  Ask ask{RequestFor("DELETE", key), key, nullptr, {}, {}, {404, 412}};
  if (!only_with_etag.empty()) ask.request.headers["if-match"] = only_with_etag;
  HttpAnswer answer = Send(ask);
  if (answer.status == 404 && S3CodeOf(answer) == "NoSuchBucket") {
    throw MakeS3Error(options_.target, NameOf(ask), answer);
  }
  return answer.status != 412;
}

void S3Client::List(const std::string& folder, const std::function<bool(const S3Object&)>& visit) {
  const size_t prefix = options_.target.prefix.size();
  std::string next;
  do {
    Ask ask{RequestFor("GET", ""), folder};
    ask.request.query = {{"list-type", "2"}, {"prefix", options_.target.prefix + folder}};
    if (!next.empty()) ask.request.query.emplace_back("continuation-token", next);
    const HttpAnswer answer = Send(ask);
    for (const std::string_view& entry : XmlElements(answer.text, "Contents")) {
      const std::string key = XmlText(entry, "Key");
      if (!key.starts_with(options_.target.prefix)) continue;
      const S3Object object{key.substr(prefix),
                            std::strtoll(XmlText(entry, "Size").c_str(), nullptr, 10),
                            XmlText(entry, "ETag"),
                            XmlText(entry, "LastModified")};
      if (!visit(object)) return;
    }
    const bool has_more = XmlText(answer.text, "IsTruncated") == "true";
    const std::string last = std::exchange(
        next, has_more ? XmlText(answer.text, "NextContinuationToken") : std::string());
    if (has_more && (next.empty() || next == last)) {
      throw S3Error(NameOf(ask) + ": the store does not continue its list; see its log", 200, "");
    }
  } while (!next.empty());
}

std::vector<S3Client::Upload> S3Client::ListUploads(const std::string& folder) {
  Ask ask{RequestFor("GET", ""), folder, nullptr, {}, {}, {501}};  // unknown to small stores
  ask.request.query = {{"uploads", ""}, {"prefix", options_.target.prefix + folder}};
  const HttpAnswer answer = Send(ask);
  std::vector<Upload> uploads;
  // One page of at most 1,000: the next sweep sees the others.
  for (const std::string_view& entry : XmlElements(answer.text, "Upload")) {
    const std::string key = XmlText(entry, "Key");
    if (!key.starts_with(options_.target.prefix + folder)) continue;
    uploads.push_back({key.substr(options_.target.prefix.size()),
                       XmlText(entry, "UploadId"),
                       XmlText(entry, "Initiated")});
  }
  return uploads;
}

void S3Client::Abort(const Upload& upload) {
  Ask ask{RequestFor("DELETE", upload.key), upload.key, nullptr, {}, {}, {404}};
  ask.request.query = {{"uploadId", upload.id}};
  Send(ask);
}

}  // namespace color3d
