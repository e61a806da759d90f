// Sends spans to a collector from a thread of its own. Whoever adds a span never waits: while the
// collector is slow or absent, the oldest spans are dropped. Thread-safe.
#pragma once

#include <atomic>
#include <chrono>
#include <deque>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "core/base/mutex.h"
#include "core/trace/otlp_json.h"
#include "core/trace/otlp_post.h"

namespace color3d {

struct ExporterOptions {
  TraceTarget target;
  TraceResource resource;
  size_t max_queue = 4096;  // spans that wait
  size_t max_batch = 512;   // spans of a request
  // Spans wait at most this long for others of their request.
  std::chrono::milliseconds pause{1'000};
  // Pauses before a request is repeated, unless the collector names one; they double.
  std::chrono::milliseconds first_retry{1'000};
  std::chrono::milliseconds longest_retry{30'000};
  int max_tries = 6;  // of a request; then its spans are dropped
  // Receives a line when sending begins to fail, and when it succeeds again; at most one a minute.
  // Called on the exporter's thread.
  std::function<void(const std::string&)> on_problem = [](const std::string&) {};
};

class SpanExporter {
 public:
  explicit SpanExporter(ExporterOptions options);
  // Aborts a request under way and drops what waits; call Flush before.
  ~SpanExporter();
  SpanExporter(const SpanExporter&) = delete;
  SpanExporter& operator=(const SpanExporter&) = delete;

  void Add(Span span);
  // Sends what waits; a request that fails meanwhile is not repeated. Returns false if that takes
  // longer than `limit`.
  bool Flush(std::chrono::milliseconds limit);
  // Counts since the start; spans that the collector refused count as dropped.
  struct Counts {
    int64_t sent = 0;
    int64_t dropped = 0;
  };
  Counts counts() const;

 private:
  using SteadyClock = std::chrono::steady_clock;
  enum class Outcome { kSent, kRefused, kAgain };
  void Loop();
  // Waits until there is something to send; returns it, or nothing at the end.
  std::vector<Span> NextBatch();
  void Send(const std::vector<Span>& spans);
  Outcome Try(const std::string& json, std::chrono::milliseconds* pause);
  // Returns false if the exporter ends or is flushed meanwhile.
  bool Sleep(std::chrono::milliseconds pause);
  void Complain(const std::string& why);
  void ReportSuccess();

  const ExporterOptions options_;
  std::atomic<bool> stop_{false};
  mutable Mutex mutex_;
  CondVar wake_, idle_;
  std::deque<Span> queue_ COLOR3D_GUARDED_BY(mutex_);
  bool sending_ COLOR3D_GUARDED_BY(mutex_) = false;
  int flushing_ COLOR3D_GUARDED_BY(mutex_) = 0;
  Counts counts_ COLOR3D_GUARDED_BY(mutex_);
  // Exporter's thread only.
  bool failing_ = false;
  bool complained_ = false;     // and the success is to be reported
  int64_t dropped_before_ = 0;  // at the complaint
  SteadyClock::time_point next_complaint_{};
  std::thread thread_;  // last, because it uses the others
};

}  // namespace color3d
