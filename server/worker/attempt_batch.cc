#include "server/worker/attempt_batch.h"

#include <spdlog/spdlog.h>

#include <algorithm>

namespace color3d {

AttemptBatch::~AttemptBatch() {
  for (Running& running : running_) running.thread.join();
}

void AttemptBatch::Start(const JobRecord& job) {
  const bool shares_process = !running_.empty();
  Running& running = running_.emplace_back();
  try {
    running.thread = std::thread([this, job, shares_process, &running] {
      RunAttempt(context_, job, shares_process);
      const MutexLock lock(mutex_);
      running.ended = true;
      ended_.NotifyAll();
    });
  } catch (const std::exception& e) {  // no more threads
    spdlog::error("{} cannot be run beside others: {}", AttemptTag(job), e.what());
    running_.pop_back();
    ReturnJob(context_.store, job);
  }
}

int AttemptBatch::Reap(std::chrono::milliseconds timeout) {
  const auto ended = [](const Running& running) { return running.ended; };
  std::list<Running> done;
  {
    const MutexLock lock(mutex_);
    const auto end = std::chrono::steady_clock::now() + timeout;
    while (std::none_of(running_.begin(), running_.end(), ended) && ended_.WaitUntil(mutex_, end)) {
    }
    for (auto it = running_.begin(); it != running_.end();) {
      const auto next = std::next(it);
      if (it->ended) done.splice(done.end(), running_, it);
      it = next;
    }
  }
  for (Running& running : done) running.thread.join();
  return static_cast<int>(done.size());
}

}  // namespace color3d
