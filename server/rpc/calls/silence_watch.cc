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
    const MutexLock lock(mutex_);
    stopping_ = true;
  }
  wake_.NotifyAll();
  thread_.join();
}

void SilenceWatch::Loop() {
  const auto tick =
      std::clamp(limit_ / 10, std::chrono::milliseconds(10), std::chrono::milliseconds(1'000));
  MutexLock lock(mutex_);
  while (true) {
    const auto end = std::chrono::steady_clock::now() + tick;
    while (!stopping_ && wake_.WaitUntil(mutex_, end)) continue;
    if (stopping_) return;
    const auto now = std::chrono::steady_clock::now();
    std::vector<std::function<void()>> calls;
    for (auto& [stream, state] : streams_) {
      if (!state.waiting || state.silent || now - state.since < stream->limit_) continue;
      state.silent = true;
      calls.push_back(stream->on_silence_);
    }
    lock.Unlock();
    for (const auto& call : calls) call();
    lock.Lock();
  }
}

SilenceWatch::Stream::Stream(SilenceWatch& watch,
                             std::function<void()> on_silence,
                             std::chrono::milliseconds limit)
    : watch_(watch),
      on_silence_(std::move(on_silence)),
      limit_(limit.count() > 0 ? limit : watch.limit_) {
  const MutexLock lock(watch_.mutex_);
  watch_.streams_.emplace(this, State());
}

SilenceWatch::Stream::~Stream() {
  const MutexLock lock(watch_.mutex_);
  watch_.streams_.erase(this);
}

void SilenceWatch::Stream::Wait() {
  const MutexLock lock(watch_.mutex_);
  State& state = watch_.streams_.at(this);
  state.waiting = true;
  state.since = std::chrono::steady_clock::now();
}

bool SilenceWatch::Stream::Resume() {
  const MutexLock lock(watch_.mutex_);
  State& state = watch_.streams_.at(this);
  state.waiting = false;
  return !state.silent;
}

}  // namespace color3d
