// Starts worker processes, restarts them when they end, and ends them at a drain. Runs one thread;
// the kernel ends the workers when that thread ends. Thread-safe.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "server/store/chore_store.h"
#include "server/worker/supervision/orphaned_workers.h"

namespace color3d {

// Demand for the inference worker: set by RPCs, read by the supervisor. Thread-safe.
class InferenceDemand {
 public:
  // The worker is not drained while a copy of the result exists.
  std::shared_ptr<void> Hold() const { return hold_; }
  bool Held() const { return hold_.use_count() > 1; }
  void Request() { requested_ = std::chrono::steady_clock::now().time_since_epoch().count(); }
  // Returns true if requested within the last minute. A worker that ends later is not restarted.
  bool Recent() const {
    const std::chrono::steady_clock::duration requested(requested_.load());
    return requested.count() != 0 &&
           std::chrono::steady_clock::now().time_since_epoch() - requested <
               std::chrono::seconds(60);
  }

 private:
  std::atomic<std::chrono::steady_clock::rep> requested_{0};
  const std::shared_ptr<void> hold_ = std::make_shared<int>();
};

struct SupervisorOptions {
  std::filesystem::path program;
  std::vector<std::string> arguments;  // in addition to --name and --parent-pid
  int workers = 1;
  // Arguments and demand of the inference worker; null: none.
  std::vector<std::string> inference_arguments;
  std::shared_ptr<const InferenceDemand> inference_demand;
  std::chrono::milliseconds first_backoff{500};
  std::chrono::milliseconds max_backoff{10'000};
  // A worker that is stopped (SIGSTOP, debugger) for this time has lost its lease and is killed.
  std::chrono::milliseconds max_stopped{180'000};
  // Workers of an earlier server, to be ended; may be null.
  std::shared_ptr<OrphanedWorkers> orphans;
  // A running worker without a report for this time is killed, unless the full disk prevents
  // reports.
  std::chrono::milliseconds max_silent{180'000};
};

class Supervisor {
 public:
  // Starts the workers. The store must outlive the supervisor, which ends the leases of dead
  // workers at once.
  Supervisor(const SupervisorOptions& options, ChoreStore& store);
  // Kills running workers.
  ~Supervisor();
  Supervisor(const Supervisor&) = delete;
  Supervisor& operator=(const Supervisor&) = delete;

  // Sends SIGTERM to all workers, to the inference worker once it is not held, and SIGKILL after
  // `grace`. Restarts none.
  void Drain(std::chrono::milliseconds grace);
  // Waits until all workers have ended after Drain.
  void Wait();

 private:
  using SteadyClock = std::chrono::steady_clock;
  struct Slot {
    std::string name;
    bool on_demand = false;  // the inference worker
    bool told = false;       // SIGTERM was sent
    pid_t pid = 0;           // 0: not running
    SteadyClock::time_point started;
    SteadyClock::time_point next_start;
    std::chrono::milliseconds backoff{0};
    SteadyClock::time_point last_moving;  // not stopped when last seen
    SteadyClock::time_point last_heard;   // time of its last new report
    int64_t report_ms = 0;
  };
  void Loop();
  bool IsWanted(const Slot& slot) const;
  void StartWorker(Slot* slot);
  void CheckWorker(Slot* slot);
  void OnExit(Slot* slot, int status);
  void KillIfFrozen(Slot* slot);
  bool IsStoreFull() const;
  void KillSilentWorkers();
  void EndOrphans();
  void ReapInheritedProcesses();

  const SupervisorOptions options_;
  ChoreStore& store_;
  std::vector<Slot> slots_;  // supervisor's thread only
  SteadyClock::time_point next_listening_, next_orphans_;
  std::atomic<bool> draining_{false};
  std::atomic<SteadyClock::time_point> kill_at_;
  std::thread thread_;
};

}  // namespace color3d
