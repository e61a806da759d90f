#include "server/worker/lease_keeper.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>

#include "core/base/memory.h"
#include "core/trace/trace_context.h"
#include "server/ops/process.h"

namespace color3d {
namespace {
constexpr size_t kMaxWarnings = 100;
}  // namespace

std::string AttemptTag(const JobRecord& job) {
  return fmt::format("[job={} attempt={}{}{}]",
                     job.name,
                     job.attempt,
                     job.trace.empty() ? "" : " trace=",
                     TraceIdOf(job.trace));
}

LeaseKeeper::LeaseKeeper(WorkerStore& store,
                         const JobRecord& job,
                         const LeaseTiming& timing,
                         const std::atomic<bool>& draining,
                         std::function<void()> on_heartbeat,
                         std::function<void(StopReason)> give_up)
    : store_(store),
      lease_{job.id, job.lease_epoch},
      tag_(AttemptTag(job)),
      timing_(timing),
      draining_(draining),
      on_heartbeat_(std::move(on_heartbeat)),
      give_up_(std::move(give_up)),
      earlier_seconds_(job.usage.seconds) {
  progress_ = job.progress;
  progress_.eta_seconds = -1.0;
  thread_ = std::thread([this] { Loop(); });
}

LeaseKeeper::~LeaseKeeper() { Stop(); }

void LeaseKeeper::Stop() {
  {
    const MutexLock lock(mutex_);
    ending_ = true;
  }
  wake_.NotifyAll();
  if (thread_.joinable()) thread_.join();
}

double LeaseKeeper::SecondsSoFar() const {
  return earlier_seconds_ + std::chrono::duration<double>(SteadyClock::now() - start_).count();
}

JobUsage LeaseKeeper::Usage() const {
  const MutexLock lock(mutex_);
  return {SecondsSoFar(), PeakMemoryBytes(), warnings_};
}

void LeaseKeeper::OnProgress(int64_t step, int64_t total_steps, const std::string& message) {
  const MutexLock lock(mutex_);
  const bool fresh = total_steps != progress_.total_steps || step < progress_.step;
  progress_.step = step;
  progress_.total_steps = total_steps;
  last_progress_ = SteadyClock::now();
  // For the log of the job; messages may change with every step.
  if (message != progress_.message && last_progress_ - last_said_ >= std::chrono::seconds(1)) {
    last_said_ = last_progress_;
    spdlog::debug("{} {}", tag_, message);
  }
  progress_.message = message;
  if (fresh) {
    eta_base_step_ = step;
    eta_base_time_ = last_progress_;
  }
  UpdateEta();
  dirty_ = true;
}

void LeaseKeeper::UpdateEta() {
  const double elapsed = std::chrono::duration<double>(last_progress_ - eta_base_time_).count();
  const int64_t done = progress_.step - eta_base_step_;
  const bool known = progress_.total_steps > 0 && done > 0 && elapsed > 0.5;
  progress_.eta_seconds = known ? elapsed / static_cast<double>(done) *
                                      static_cast<double>(progress_.total_steps - progress_.step)
                                : -1.0;
}

void LeaseKeeper::OnError(int64_t, const std::string& error_name, double value) {
  const MutexLock lock(mutex_);
  progress_.error_name = error_name;
  progress_.error_value = std::isfinite(value) ? value : 0.0;
  last_progress_ = SteadyClock::now();
  dirty_ = true;
}

void LeaseKeeper::OnWarning(const std::string& message) {
  spdlog::warn("{} {}", tag_, message);
  const MutexLock lock(mutex_);
  const bool known = std::find(warnings_.begin(), warnings_.end(), message) != warnings_.end();
  if (!known && warnings_.size() < kMaxWarnings) warnings_.push_back(message);
}

void LeaseKeeper::StopStage(StopReason reason) {
  StopReason expected = StopReason::kNone;
  if (!reason_.compare_exchange_strong(expected, reason)) return;
  stopped_at_ = SteadyClock::now();
  token_.Cancel();
}

// Stores progress and extends the lease, or only checks for a cancellation request.
void LeaseKeeper::SendHeartbeat() {
  ProgressRecord progress;
  JobUsage usage;
  bool dirty = false;
  {
    const MutexLock lock(mutex_);
    progress = progress_;
    usage.warnings = warnings_;
    dirty = dirty_;
    dirty_ = false;
  }
  usage.seconds = SecondsSoFar();
  const auto now = SteadyClock::now();
  try {
    bool cancel = false;
    if (dirty || now - last_attempt_ >= timing_.heartbeat) {
      last_attempt_ = now;
      cancel = store_.Heartbeat(lease_, progress, usage, timing_.lease.count()).cancel_requested;
      last_success_ = now;
    } else if (now - last_peek_ >= std::min(timing_.heartbeat, std::chrono::milliseconds(1000))) {
      cancel = store_.Peek(lease_).cancel_requested;
      last_peek_ = now;
    }
    if (cancel) StopStage(StopReason::kCancelled);
    if (now - last_report_ >= timing_.heartbeat) {
      last_report_ = now;
      on_heartbeat_();
    }
  } catch (const std::exception& e) {
    const auto* error = dynamic_cast<const Error*>(&e);
    if (error != nullptr && error->code() == ErrorCode::kAborted) {
      StopStage(StopReason::kLeaseLost);
    } else {
      // While the server is away, each one fails.
      if (now < next_complaint_) return;
      next_complaint_ = now + timing_.heartbeat;
      spdlog::warn("{} heartbeat failed: {}", tag_, e.what());
    }
  }
}

void LeaseKeeper::Loop() {
  const auto tick = std::min(timing_.progress, timing_.heartbeat / 2);
  while (true) {
    SteadyClock::time_point last_progress;
    {
      MutexLock lock(mutex_);
      const auto end = SteadyClock::now() + tick;
      while (!ending_ && wake_.WaitUntil(mutex_, end)) {
      }
      if (ending_) return;
      last_progress = last_progress_;
    }
    SendHeartbeat();
    const auto now = SteadyClock::now();
    // A worker that cannot reach the store stops before another worker can claim its job.
    if (SteadyClock::now() - last_success_ > timing_.lease * 2 / 3) {
      StopStage(StopReason::kLeaseLost);
    }
    if (draining_.load()) StopStage(StopReason::kDraining);
    if (now - last_progress > timing_.stuck) StopStage(StopReason::kStuck);
    const StopReason reason = reason_.load();
    if (reason != StopReason::kNone) {
      const auto grace = reason == StopReason::kDraining ? timing_.drain_grace : timing_.stop_grace;
      if (SteadyClock::now() - stopped_at_ > grace) give_up_(reason);
    }
  }
}

}  // namespace color3d
