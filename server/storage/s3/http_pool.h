// HTTP calls by libcurl over connections that are kept open. Thread-safe.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/mutex.h"

namespace color3d {

struct HttpCall {
  std::string method = "GET";
  std::string url;
  std::vector<std::string> headers = {};  // "Name: value"
  // Copies bytes of the body from `offset` to `buffer`, at most `size`; returns their number.
  std::function<size_t(int64_t offset, char* buffer, size_t size)> body = {};
  int64_t body_bytes = -1;  // -1: no body
  // Gets the body of a 2xx answer; others, and all without a sink, are in HttpAnswer::text.
  std::function<void(std::string_view)> sink = {};
  // The call fails after this time without a byte in either direction.
  std::chrono::seconds stall{30};
};

struct HttpAnswer {
  int status = 0;                              // 0: no answer
  std::map<std::string, std::string> headers;  // by lower-case name
  std::string text;
  std::string failure;          // of the connection; empty: the whole answer was received
  bool is_worth_retry = false;  // the failure may pass

  // Empty if there is none.
  std::string Header(const std::string& name) const {
    const auto header = headers.find(name);
    return header == headers.end() ? "" : header->second;
  }
};

class HttpPool {
 public:
  // `authorities`: PEM file of the certificates that are trusted; empty: those of the system.
  HttpPool(std::filesystem::path authorities, std::chrono::milliseconds connect_limit);
  ~HttpPool();
  HttpPool(const HttpPool&) = delete;
  HttpPool& operator=(const HttpPool&) = delete;

  // Exceptions of the body and the sink pass through. Fails soon after Stop.
  HttpAnswer Call(const HttpCall& call);
  // Ends the calls under way and all later ones.
  void Stop();
  bool is_stopped() const { return stopped_; }
  // Waits, at most until Stop; returns false then.
  bool Pause(std::chrono::milliseconds time);

 private:
  struct Connections;
  const std::filesystem::path authorities_;
  const std::chrono::milliseconds connect_limit_;
  const std::unique_ptr<Connections> connections_;
  std::atomic<bool> stopped_{false};
  Mutex mutex_;
  CondVar wake_;
};

}  // namespace color3d
