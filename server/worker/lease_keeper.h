// Keeps the lease of a running job: sends heartbeats from its own thread, coalesces progress, and
// cancels one token for each reason to stop (cancelled by a user, lease lost, drain, stuck).
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/mutex.h"
#include "core/base/progress.h"
#include "server/store/worker_store.h"

namespace color3d {

struct LeaseTiming {
  std::chrono::milliseconds lease{60'000};
  std::chrono::milliseconds heartbeat{10'000};
  // Minimum time between updates of progress in the store.
  std::chrono::milliseconds progress{250};
  // A stage without progress for this time counts as stuck.
  std::chrono::milliseconds stuck{15 * 60'000};
  // The process is ended if a stage has not stopped this long after the request.
  std::chrono::milliseconds stop_grace{60'000};
  std::chrono::milliseconds drain_grace{15'000};
  // Pause between attempts to store the outcome.
  std::chrono::milliseconds report_pause{1'000};
};

// Returns "[job=jobs/... attempt=1]", the prefix of log lines about the attempt.
std::string AttemptTag(const JobRecord& job);

enum class StopReason { kNone, kCancelled, kLeaseLost, kDraining, kStuck };

// Thread-safe. The stage reports progress here from its own threads.
class LeaseKeeper : public ProgressObserver {
 public:
  // `store` is used by the heartbeat thread and needs its own connection. `draining` becomes true
  // when the worker must stop. The heartbeat thread calls `on_heartbeat` after each full heartbeat,
  // and `give_up` if the stage does not stop in time; `give_up` must end the process.
  LeaseKeeper(WorkerStore& store,
              const JobRecord& job,
              const LeaseTiming& timing,
              const std::atomic<bool>& draining,
              std::function<void()> on_heartbeat,
              std::function<void(StopReason)> give_up);
  ~LeaseKeeper() override;

  const CancellationToken& token() const { return token_; }
  StopReason stop_reason() const { return reason_.load(); }
  // Ends the heartbeats; the caller then publishes or fails the job.
  void Stop();
  // Returns seconds over all attempts, warnings and peak memory so far.
  JobUsage Usage() const;
  Lease lease() const { return lease_; }

  void OnProgress(int64_t step, int64_t total_steps, const std::string& message) override;
  void OnError(int64_t iteration, const std::string& error_name, double value) override;
  void OnWarning(const std::string& message) override;

 private:
  using SteadyClock = std::chrono::steady_clock;
  void Loop();
  void SendHeartbeat();
  void StopStage(StopReason reason);
  double SecondsSoFar() const;
  void UpdateEta() COLOR3D_REQUIRES(mutex_);

  WorkerStore& store_;
  const Lease lease_;
  const std::string tag_;  // of log lines
  const LeaseTiming timing_;
  const std::atomic<bool>& draining_;
  const std::function<void()> on_heartbeat_;
  const std::function<void(StopReason)> give_up_;
  const double earlier_seconds_;
  const SteadyClock::time_point start_ = SteadyClock::now();
  CancellationToken token_;
  std::atomic<StopReason> reason_{StopReason::kNone};
  SteadyClock::time_point stopped_at_;  // heartbeat thread only

  mutable Mutex mutex_;
  CondVar wake_;
  bool ending_ COLOR3D_GUARDED_BY(mutex_) = false;
  bool dirty_ COLOR3D_GUARDED_BY(mutex_) = false;
  ProgressRecord progress_ COLOR3D_GUARDED_BY(mutex_);
  std::vector<std::string> warnings_ COLOR3D_GUARDED_BY(mutex_);
  SteadyClock::time_point last_progress_ COLOR3D_GUARDED_BY(mutex_) = start_;
  SteadyClock::time_point last_said_ COLOR3D_GUARDED_BY(mutex_);
  // Begin of the present run of steps, for the estimated remaining time.
  int64_t eta_base_step_ COLOR3D_GUARDED_BY(mutex_) = 0;
  SteadyClock::time_point eta_base_time_ COLOR3D_GUARDED_BY(mutex_) = start_;

  SteadyClock::time_point last_attempt_ = start_;  // heartbeat thread only
  SteadyClock::time_point last_success_ = start_;
  SteadyClock::time_point last_peek_ = start_;
  SteadyClock::time_point last_report_ = start_;
  SteadyClock::time_point next_complaint_ = start_;
  std::thread thread_;
};

}  // namespace color3d
