#include "core/trace/span_exporter.h"

#include <fmt/core.h>

#include <algorithm>
#include <iterator>
#include <utility>

namespace color3d {
namespace {

constexpr auto kBetweenComplaints = std::chrono::minutes(1);

// The codes that the protocol names.
bool IsTemporary(int status) {
  return status == 429 || status == 502 || status == 503 || status == 504;
}

}  // namespace

SpanExporter::SpanExporter(ExporterOptions options) : options_(std::move(options)) {
  thread_ = std::thread([this] { Loop(); });
}

SpanExporter::~SpanExporter() {
  {
    const MutexLock lock(mutex_);
    stop_ = true;
  }
  wake_.NotifyAll();
  thread_.join();
}

void SpanExporter::Add(Span span) {
  {
    const MutexLock lock(mutex_);
    if (stop_.load()) return;
    queue_.push_back(std::move(span));
    if (queue_.size() > options_.max_queue) {
      queue_.pop_front();
      ++counts_.dropped;
    }
    if (queue_.size() != 1 && queue_.size() < options_.max_batch) return;
  }
  wake_.NotifyAll();
}

bool SpanExporter::Flush(std::chrono::milliseconds limit) {
  const auto end = SteadyClock::now() + limit;
  MutexLock lock(mutex_);
  ++flushing_;
  wake_.NotifyAll();
  bool in_time = true;
  while (in_time && !stop_.load() && (sending_ || !queue_.empty())) {
    in_time = idle_.WaitUntil(mutex_, end);
  }
  --flushing_;
  return !sending_ && queue_.empty();
}

SpanExporter::Counts SpanExporter::counts() const {
  const MutexLock lock(mutex_);
  return counts_;
}

void SpanExporter::Loop() {
  while (true) {
    const std::vector<Span> batch = NextBatch();
    if (batch.empty()) return;
    Send(batch);
    {
      const MutexLock lock(mutex_);
      sending_ = false;
    }
    idle_.NotifyAll();
  }
}

std::vector<Span> SpanExporter::NextBatch() {
  MutexLock lock(mutex_);
  while (!stop_.load() && queue_.empty()) wake_.Wait(mutex_);
  const auto end = SteadyClock::now() + options_.pause;
  while (!stop_.load() && flushing_ == 0 && queue_.size() < options_.max_batch &&
         wake_.WaitUntil(mutex_, end)) {
  }
  if (stop_.load()) return {};
  const auto count =
      static_cast<std::ptrdiff_t>(std::min(std::max<size_t>(1, options_.max_batch), queue_.size()));
  std::vector<Span> batch(std::make_move_iterator(queue_.begin()),
                          std::make_move_iterator(queue_.begin() + count));
  queue_.erase(queue_.begin(), queue_.begin() + count);
  sending_ = true;
  return batch;
}

void SpanExporter::Send(const std::vector<Span>& spans) {
  const std::string json = ToOtlpJson(options_.resource, spans);
  std::chrono::milliseconds backoff = options_.first_retry;
  Outcome outcome = Outcome::kAgain;
  for (int tries = 1; outcome == Outcome::kAgain; ++tries) {
    std::chrono::milliseconds pause = backoff;
    outcome = Try(json, &pause);
    if (outcome != Outcome::kAgain) break;
    if (tries >= options_.max_tries || !Sleep(pause)) break;
    backoff = std::min(backoff * 2, options_.longest_retry);
  }
  const auto count = static_cast<int64_t>(spans.size());
  {
    const MutexLock lock(mutex_);
    (outcome == Outcome::kSent ? counts_.sent : counts_.dropped) += count;
  }
  if (outcome == Outcome::kSent) ReportSuccess();
}

SpanExporter::Outcome SpanExporter::Try(const std::string& json, std::chrono::milliseconds* pause) {
  const TraceAnswer answer = PostTraces(options_.target, json, stop_);
  if (answer.status >= 200 && answer.status < 300) return Outcome::kSent;
  if (stop_.load()) return Outcome::kRefused;
  Complain(answer.status == 0 ? answer.problem : fmt::format("HTTP status {}", answer.status));
  if (answer.status != 0 && !IsTemporary(answer.status)) return Outcome::kRefused;
  if (answer.retry_after.count() > 0) *pause = answer.retry_after;
  return Outcome::kAgain;
}

bool SpanExporter::Sleep(std::chrono::milliseconds pause) {
  const auto end = SteadyClock::now() + pause;
  MutexLock lock(mutex_);
  while (!stop_.load() && flushing_ == 0 && wake_.WaitUntil(mutex_, end)) {
  }
  return !stop_.load() && flushing_ == 0;
}

void SpanExporter::Complain(const std::string& why) {
  if (failing_) return;
  failing_ = true;
  const auto now = SteadyClock::now();
  if (now < next_complaint_) return;
  next_complaint_ = now + kBetweenComplaints;
  complained_ = true;
  dropped_before_ = counts().dropped;
  options_.on_problem(fmt::format(
      "traces cannot be sent to {} ({}); the oldest are dropped until it answers, nothing else "
      "is affected",
      options_.target.url,
      why));
}

void SpanExporter::ReportSuccess() {
  failing_ = false;
  if (!complained_) return;
  complained_ = false;
  const int64_t dropped = counts().dropped - dropped_before_;
  options_.on_problem(fmt::format(
      "traces are sent to {} again; {} spans were dropped", options_.target.url, dropped));
}

}  // namespace color3d
