#include "server/worker/remote/log_sender.h"

#include <chrono>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr size_t kMaxLines = 2'000;
constexpr size_t kMaxLineBytes = 4'000;
constexpr auto kPause = std::chrono::milliseconds(500);

}  // namespace

LogSender::LogSender(WorkerLink& link) : link_(link) {
  thread_ = std::thread([this] { Loop(); });
}

LogSender::~LogSender() {
  {
    const MutexLock lock(mutex_);
    ending_ = true;
  }
  wake_.NotifyAll();
  thread_.join();
}

void LogSender::Add(const std::string& job, const std::string& line) {
  const MutexLock lock(mutex_);
  if (waiting_.size() >= kMaxLines) waiting_.pop_front();
  waiting_.emplace_back(job, line.substr(0, kMaxLineBytes));
}

bool LogSender::Send(const std::deque<std::pair<std::string, std::string>>& lines) {
  internal::v1::AppendJobLogsRequest request;
  for (const auto& [job, text] : lines) {
    internal::v1::JobLogLine* line = request.add_lines();
    line->set_job(job);
    line->set_text(text);
  }
  try {
    link_.Once(&WorkerLink::Stub::AppendJobLogs, request);
    return true;
  } catch (const Error& e) {
    // Lines that the server refuses would be refused again.
    return e.code() != ErrorCode::kUnavailable;
  }
}

void LogSender::Loop() {
  bool ending = false;
  while (!ending) {
    std::deque<std::pair<std::string, std::string>> lines;
    {
      MutexLock lock(mutex_);
      const auto end = std::chrono::steady_clock::now() + kPause;
      while (!ending_ && wake_.WaitUntil(mutex_, end)) {
      }
      ending = ending_;
      lines.swap(waiting_);
    }
    if (lines.empty() || Send(lines)) continue;
    const MutexLock lock(mutex_);
    while (!lines.empty() && waiting_.size() < kMaxLines) {
      waiting_.push_front(std::move(lines.back()));
      lines.pop_back();
    }
  }
}

}  // namespace color3d
