#include "server/maintenance.h"

#include <signal.h>
#include <spdlog/spdlog.h>

#include <cerrno>

#include "core/base/error.h"

namespace color3d {
namespace fs = std::filesystem;

void ExpireDeadWorkers(JobStore& store) {
  for (const WorkerRecord& worker : store.ListWorkers()) {
    if (::kill(static_cast<pid_t>(worker.pid), 0) == 0 || errno != ESRCH) continue;
    for (const std::string& job : store.ExpireLeasesOf(worker.worker_id)) {
      spdlog::info("[job={}] its worker {} is gone", job, worker.worker_id);
    }
    store.RemoveWorker(worker.worker_id);
  }
}

Maintenance::Maintenance(JobStore& store,
                         BlobStore& blobs,
                         UploadStore& uploads,
                         const DataPaths& paths,
                         const Clock& clock,
                         const MaintenanceTiming& timing)
    : store_(store),
      blobs_(blobs),
      uploads_(uploads),
      paths_(paths),
      clock_(clock),
      timing_(timing) {
  thread_ = std::thread([this] { Loop(); });
}

Maintenance::~Maintenance() {
  {
    std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void Maintenance::Loop() {
  using SteadyClock = std::chrono::steady_clock;
  auto next_sweep = SteadyClock::now();
  std::unique_lock lock(mutex_);
  do {
    lock.unlock();
    try {
      const int reaped = store_.ReapExpired();
      if (reaped > 0) spdlog::warn("{} attempts were lost with their worker", reaped);
      if (SteadyClock::now() >= next_sweep) {
        next_sweep = SteadyClock::now() + timing_.sweep;
        Sweep();
      }
    } catch (const std::exception& e) {
      spdlog::error("maintenance: {}", e.what());
    }
    lock.lock();
  } while (!wake_.wait_for(lock, timing_.reap, [this] { return stopping_; }));
}

void Maintenance::Sweep() {
  const int uploads = uploads_.ReapOlderThan(timing_.grace);
  const BlobStore::Sweep swept = blobs_.RemoveUnreferenced(store_.ReferencedBlobs(), timing_.grace);
  SweepScratch();
  const auto before = [this](std::chrono::milliseconds age) { return clock_() - age.count(); };
  store_.Compact(before(timing_.keep_events), before(timing_.keep_request_ids));
  spdlog::info("swept {} blobs ({} MiB) and {} uploads", swept.removed, swept.bytes >> 20, uploads);
}

// Folders "<job id>-<epoch>" of attempts that no longer run.
void Maintenance::SweepScratch() {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(paths_.Scratch(), error)) {
    const std::string name = entry.path().filename().string();
    const size_t dash = name.rfind('-');
    if (dash == std::string::npos) continue;
    const int64_t epoch = store_.RunningEpoch("jobs/" + name.substr(0, dash));
    if (std::to_string(epoch) != name.substr(dash + 1)) fs::remove_all(entry.path(), error);
  }
}

}  // namespace color3d
