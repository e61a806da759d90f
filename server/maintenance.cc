#include "server/maintenance.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <utility>

#include "core/base/error.h"
#include "core/base/folder_walk.h"
#include "server/ops/process_state.h"
#include "server/storage/collector.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

bool IsRetryableLater(const Error& error) {
  return error.code() == ErrorCode::kResourceExhausted || error.code() == ErrorCode::kUnavailable;
}

}  // namespace

void ExpireDeadWorkers(ChoreStore& store) {
  for (const WorkerRecord& worker : store.ListWorkers()) {
    // Without a pid it runs on another machine, and may still hold its leases.
    if (worker.pid == 0 || IsRunning(static_cast<pid_t>(worker.pid))) continue;
    try {
      for (const std::string& job : store.ExpireLeases(worker.worker_id)) {
        spdlog::info("[job={}] its worker {} is gone", job, worker.worker_id);
      }
      store.RemoveWorker(worker.worker_id);
    } catch (const Error& e) {
      if (e.code() != ErrorCode::kResourceExhausted) throw;
      spdlog::error("{} has ended, its leases will expire: {}", worker.worker_id, e.what());
    }
  }
}

Scrubber::Result Scrubber::Scrub(std::vector<StoredBlob> blobs,
                                 int64_t bytes,
                                 const std::function<bool()>& stop) {
  const auto name = [](const StoredBlob& blob) -> const std::string& { return blob.digest.sha256; };
  std::ranges::sort(blobs, {}, name);
  std::rotate(blobs.begin(), std::ranges::upper_bound(blobs, last_, {}, name), blobs.end());
  Result result;
  for (const StoredBlob& blob : blobs) {
    if (result.bytes >= bytes || stop()) break;
    result.bytes += blob.digest.size_bytes;
    last_ = name(blob);
    try {
      if (!IsIntact(blobs_, blob.digest) && blobs_.SetAside(last_)) result.damaged.push_back(last_);
    } catch (const Error& e) {
      if (e.code() == ErrorCode::kNotFound) continue;  // removed meanwhile
      result.unreadable.push_back(last_ + ": " + e.what());
    }
  }
  return result;
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
      timing_(timing),
      scrubber_(blobs) {
  reaper_ = std::thread([this] { Repeat([this] { return Reap(); }); });
  sweeper_ = std::thread([this] { Repeat([this] { return Sweep(); }); });
}

Maintenance::~Maintenance() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
  }
  wake_.NotifyAll();
  reaper_.join();
  sweeper_.join();
}

bool Maintenance::IsStopping() {
  const MutexLock lock(mutex_);
  return stopping_;
}

void Maintenance::Repeat(const std::function<std::chrono::milliseconds()>& chore) {
  while (true) {
    const std::chrono::milliseconds pause = chore();
    const MutexLock lock(mutex_);
    const auto end = std::chrono::steady_clock::now() + pause;
    while (!stopping_ && wake_.WaitUntil(mutex_, end)) {
    }
    if (stopping_) return;
  }
}

std::chrono::milliseconds Maintenance::Reap() {
  try {
    // The server can answer reads even on a full disk.
    store_.NewestRevision();
    if (timing_.on_life) timing_.on_life();
    const int reaped = store_.ReapExpired();
    counts_.attempts_lost += reaped;
    if (reaped > 0) spdlog::warn("{} attempts were lost with their worker", reaped);
    if (timing_.has_chores()) PauseWhenSpaceIsLow();
    ReturnFreeSpace();
    ForgetLostWorkers();
  } catch (const std::exception& e) {
    spdlog::error("cannot check leases: {}", e.what());
  }
  return timing_.reap;
}

// Measured by the steady clock from the first sight of a report, because the wall clock may jump.
void Maintenance::ForgetLostWorkers() {
  const auto now = std::chrono::steady_clock::now();
  std::map<std::string, Report> reports;
  for (const WorkerRecord& worker : store_.ListWorkers()) {
    if (worker.pid != 0) continue;
    const auto known = reports_.find(worker.worker_id);
    const bool is_new = known == reports_.end() || known->second.at_ms != worker.heartbeat_ms;
    const Report report = is_new ? Report{worker.heartbeat_ms, now} : known->second;
    if (now - report.seen > timing_.forget_workers) {
      spdlog::warn("{} has not reported for long; it is no longer listed", worker.worker_id);
      store_.RemoveWorker(worker.worker_id);
    } else {
      reports[worker.worker_id] = report;
    }
  }
  reports_ = std::move(reports);
}

void Maintenance::ReturnFreeSpace() {
  try {
    store_.ReturnFreeSpace(timing_.keep_free_rows_bytes);
  } catch (const Error& e) {
    // Tried again later if the disk is full or another process blocks writes.
    if (!IsRetryableLater(e)) throw;
  }
  Ballast* const ballast = timing_.ballast;
  if (ballast == nullptr || ballast->IsThere()) return;
  if (blobs_.FreeBytes() >= timing_.reserve_bytes + 2 * ballast->bytes()) ballast->Make();
}

void Maintenance::PauseWhenSpaceIsLow() {
  const bool held = store_.Holds().contains(Hold::kStorage);
  const int64_t free = blobs_.FreeBytes();
  const int64_t wanted = timing_.low_space_bytes + (held ? timing_.low_space_bytes / 10 : 0);
  if (held == (free < wanted)) return;
  store_.SetHold(Hold::kStorage, !held);
  if (held) {
    spdlog::info("{} MiB are free again: jobs are begun", free >> 20);
  } else {
    spdlog::error("only {} MiB are free: no job is begun until there are {}; free some disk space",
                  free >> 20,
                  timing_.low_space_bytes >> 20);
  }
}

std::chrono::milliseconds Maintenance::Sweep() {
  try {
    const bool has_chores = timing_.has_chores();
    auto [uploads, unreadable] = uploads_.ReapOlderThan(timing_.grace);
    if (uploads > 0) spdlog::info("swept {} unfinished uploads", uploads);
    SweepScratch(&unreadable);
    SweepJobLogs(&unreadable);
    if (has_chores) SweepForAll(&unreadable);
    if (unreadable.empty()) return has_chores ? timing_.sweep : timing_.sweep_again;
    ++counts_.sweeps_failed;
    constexpr size_t kTold = 5;
    for (size_t i = 0; i < std::min(kTold, unreadable.size()); ++i) {
      spdlog::error("the sweep cannot read {}", unreadable[i]);
    }
    spdlog::error(
        "the sweep passed over {} places that it cannot read and is tried again soon; "
        "change their owner or rights, or look after the disk",
        unreadable.size());
  } catch (const std::exception& e) {
    ++counts_.sweeps_failed;
    spdlog::error("the sweep failed and is tried again soon: {}", e.what());
  }
  return timing_.sweep_again;
}

void Maintenance::SweepForAll(std::vector<std::string>* unreadable) {
  const auto [blobs, unread] = ListBlobs(blobs_, [this] { return IsStopping(); });
  unreadable->insert(unreadable->end(), unread.begin(), unread.end());
  ExpireJobs();
  CollectBlobs(blobs);
  const auto before = [this](std::chrono::milliseconds age) { return clock_() - age.count(); };
  store_.Compact(before(timing_.keep_events), before(timing_.keep_request_ids));
  Scrub(blobs, unreadable);
}

// Once per regular sweep, not per retry of a failed one.
void Maintenance::Scrub(const std::vector<StoredBlob>& blobs,
                        std::vector<std::string>* unreadable) {
  const auto now = std::chrono::steady_clock::now();
  if (now < next_scrub_) return;
  next_scrub_ = now + timing_.sweep;
  const Scrubber::Result scrubbed =
      scrubber_.Scrub(blobs, timing_.scrub_bytes, [this] { return IsStopping(); });
  for (const std::string& sha256 : scrubbed.damaged) {
    spdlog::error(
        "the blob {} was damaged on the disk and is set aside{}",
        sha256,
        store_.IsReferenced(sha256) ? "; what names it needs it uploaded or made again" : "");
  }
  unreadable->insert(unreadable->end(), scrubbed.unreadable.begin(), scrubbed.unreadable.end());
}

void Maintenance::CollectBlobs(const std::vector<StoredBlob>& blobs) {
  if (IsStopping()) return;
  const std::vector<StoredBlob> due = DueBlobs(store_, blobs, timing_.grace);
  const size_t removed = RemoveDue(store_, blobs_, due, [this] { return IsStopping(); }).size();
  counts_.blobs_removed += static_cast<int64_t>(removed);
  const int leftovers = blobs_.RemoveLeftovers(timing_.grace);
  if (removed + static_cast<size_t>(leftovers) > 0) {
    spdlog::info("swept {} blobs, {} left-overs", removed, leftovers);
  }
}

// In two phases, so that a clock jump expires nothing.
void Maintenance::ExpireJobs() {
  constexpr int64_t kNever = INT64_MIN;
  const auto before = [this](std::chrono::milliseconds age) {
    return age.count() == 0 ? kNever : clock_() - age.count();
  };
  const std::chrono::milliseconds grace = timing_.grace;
  const auto make_room = [this] {
    return timing_.ballast != nullptr && timing_.ballast->Release();
  };
  const auto remove = [&](const auto& body) {
    if (IsStopping()) return;
    try {
      RetryAfterMakingRoom(make_room, body);
    } catch (const Error& e) {
      // The job was used, retried or deleted meanwhile.
      if (e.code() != ErrorCode::kFailedPrecondition && e.code() != ErrorCode::kNotFound) throw;
    }
  };
  for (const std::string& scene : store_.AgeUnusedScenes(
           before(timing_.keep_jobs), before(timing_.keep_uncommitted), grace.count())) {
    remove([&] {
      store_.DeleteScene(scene, {});
      spdlog::info("{} was old, without a job, and is deleted", scene);
    });
  }
  if (timing_.keep_jobs.count() == 0) return;
  for (const std::string& name : store_.AgeExpired(before(timing_.keep_jobs), grace.count())) {
    remove([&] {
      const std::string scene = store_.GetJob(name).scene;
      store_.Delete(name, {});
      ++counts_.jobs_expired;
      spdlog::info("[job={}] was old and is deleted", name);
      if (!store_.ListJobs({"", scene, std::nullopt}, 0, 1, {}).empty()) return;
      store_.DeleteScene(scene, {});
      spdlog::info("{} had no job left and is deleted", scene);
    });
  }
}

void Maintenance::SweepJobLogs(std::vector<std::string>* unreadable) {
  const auto problems =
      WalkFolder(paths_.JobLogs(), WalkDepth::kFolder, [this](const fs::directory_entry& entry) {
        if (IsStopping()) return false;
        try {
          store_.GetJob("jobs/" + entry.path().stem().string());
        } catch (const Error& e) {
          std::error_code error;
          if (e.code() == ErrorCode::kNotFound) fs::remove(entry.path(), error);
        }
        return true;
      });
  unreadable->insert(unreadable->end(), problems.begin(), problems.end());
}

// Removes folders "<job id>-<epoch>" of attempts that no longer run.
void Maintenance::SweepScratch(std::vector<std::string>* unreadable) {
  std::vector<std::string> unremoved;
  const auto problems =
      WalkFolder(paths_.Scratch(), WalkDepth::kFolder, [&](const fs::directory_entry& entry) {
        const std::string name = entry.path().filename().string();
        const size_t dash = name.rfind('-');
        if (dash == std::string::npos) return true;
        const int64_t epoch = store_.RunningEpoch("jobs/" + name.substr(0, dash));
        if (std::to_string(epoch) == name.substr(dash + 1)) return true;
        std::error_code error;
        fs::remove_all(entry.path(), error);
        if (error) unremoved.push_back(entry.path().string() + ": " + error.message());
        return true;
      });
  unreadable->insert(unreadable->end(), problems.begin(), problems.end());
  unreadable->insert(unreadable->end(), unremoved.begin(), unremoved.end());
}

}  // namespace color3d
