#include "server/rpc/calls/silence_watch.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace color3d {

SilenceWatch::SilenceWatch(std::chrono::milliseconds limit) : limit_(limit) {
  thread_ = std::thread([this] { Loop(); });
}

SilenceWatch::~SilenceWatch() {
  {
    std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void SilenceWatch::Loop() {
  const auto tick =
      std::clamp(limit_ / 10, std::chrono::milliseconds(10), std::chrono::milliseconds(1'000));
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, tick, [this] { return stopping_; })) {
    const auto now = std::chrono::steady_clock::now();
    std::vector<std::function<void()>> calls;
    for (Stream* stream : streams_) {
      if (!stream->waiting_ || stream->silent_ || now - stream->since_ < stream->limit_) continue;
      stream->silent_ = true;
      calls.push_back(stream->on_silence_);
    }
    lock.unlock();
    for (const auto& call : calls) call();
    lock.lock();
  }
}

SilenceWatch::Stream::Stream(SilenceWatch& watch,
                             std::function<void()> on_silence,
                             std::chrono::milliseconds limit)
    : watch_(watch),
      on_silence_(std::move(on_silence)),
      limit_(limit.count() > 0 ? limit : watch.limit_) {
  std::lock_guard lock(watch_.mutex_);
  watch_.streams_.insert(this);
}

SilenceWatch::Stream::~Stream() {
  std::lock_guard lock(watch_.mutex_);
  watch_.streams_.erase(this);
}

void SilenceWatch::Stream::Wait() {
  std::lock_guard lock(watch_.mutex_);
  waiting_ = true;
  since_ = std::chrono::steady_clock::now();
}

bool SilenceWatch::Stream::Resume() {
  std::lock_guard lock(watch_.mutex_);
  waiting_ = false;
  return !silent_;
}

}  // namespace color3d
