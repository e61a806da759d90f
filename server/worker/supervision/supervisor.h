// Starts worker processes, starts them again when they end, and ends them at a drain. One thread,
// which also is the one that the kernel ties the workers' lives to.
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

// Asked for by RPCs, heeded by the supervisor: whether the inference worker should be running.
// Thread-safe.
class InferenceDemand {
 public:
  // While a copy of what this returns lives, the worker is not drained.
  std::shared_ptr<void> Hold() const { return hold_; }
  bool Held() const { return hold_.use_count() > 1; }
  void Request() { requested_ = std::chrono::steady_clock::now().time_since_epoch().count(); }
  // Within the last minute. A worker that ends by itself afterwards is not missed.
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
  std::vector<std::string> arguments;  // besides --name and --parent-pid
  int workers = 1;
  // Arguments of the inference worker, and when it is wanted; null: there is none.
  std::vector<std::string> inference_arguments;
  std::shared_ptr<const InferenceDemand> inference_demand;
  std::chrono::milliseconds first_backoff{500};
  std::chrono::milliseconds max_backoff{10'000};
  // A worker that is stopped (SIGSTOP, a debugger) for this long is killed: it has lost its lease.
  std::chrono::milliseconds max_stopped{180'000};
  // ... or for this long while nobody can write to the store, which it may have stopped in: before
  // the leases of all others run out with its own.
  std::chrono::milliseconds max_stopped_holding{10'000};
  // Those of an earlier server, to be seen to their end; may be null.
  std::shared_ptr<OrphanedWorkers> orphans;
  // A worker that runs but has not reported itself for so long is killed, too; not where no report
  // can be written, for the disk is full.
  std::chrono::milliseconds max_silent{180'000};
};

class Supervisor {
 public:
  // Starts the workers. The store outlives the supervisor; it learns of dead workers at once, so
  // that their jobs need not wait for the lease's end.
  Supervisor(const SupervisorOptions& options, ChoreStore& store);
  // Kills what still runs.
  ~Supervisor();
  Supervisor(const Supervisor&) = delete;
  Supervisor& operator=(const Supervisor&) = delete;

  // SIGTERM to all workers, to the inference worker once nobody holds it; no more restarts; SIGKILL
  // to those that still run after `grace`.
  void Drain(std::chrono::milliseconds grace);
  // Waits until all workers have ended after Drain.
  void Wait();

 private:
  using SteadyClock = std::chrono::steady_clock;
  struct Slot {
    std::string name;
    bool on_demand = false;  // the inference worker
    bool told = false;       // to end, by SIGTERM
    pid_t pid = 0;           // 0: not running
    SteadyClock::time_point started;
    SteadyClock::time_point next_start;
    std::chrono::milliseconds backoff{0};
    SteadyClock::time_point last_moving;  // not stopped when last seen
    SteadyClock::time_point last_heard;   // its report was another one
    int64_t report_ms = 0;
  };
  void Loop();
  bool IsWanted(const Slot& slot) const;
  void StartWorker(Slot* slot);
  void CheckWorker(Slot* slot);
  void OnExit(Slot* slot, int status);
  void KillIfFrozen(Slot* slot);
  bool IsStoreHeld() const;
  bool IsStoreFull() const;
  void KillSilentWorkers();
  void EndOrphans();
  void ReapStrangers();

  const SupervisorOptions options_;
  ChoreStore& store_;
  std::vector<Slot> slots_;  // supervisor's thread only
  SteadyClock::time_point next_listening_, next_orphans_;
  std::atomic<bool> draining_{false};
  std::atomic<SteadyClock::time_point> kill_at_;
  std::thread thread_;
};

}  // namespace color3d
