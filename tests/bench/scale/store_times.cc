#include "tests/bench/scale/store_times.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <thread>

#include "core/base/error.h"
#include "core/base/files.h"
#include "tests/bench/scale/store_history.h"

namespace color3d {
namespace {

using SteadyClock = std::chrono::steady_clock;
constexpr int64_t kLeaseMs = 60'000;
constexpr int kManyArtifacts = 21;
constexpr int kShortQueue = 50;

// Milliseconds of calls by name. Thread-safe.
class CallRecorder {
 public:
  template <typename Body>
  auto Time(const std::string& call, const Body& body) {
    struct Ending {
      CallRecorder& recorder;
      const std::string& call;
      const SteadyClock::time_point begin = SteadyClock::now();
      ~Ending() {
        const std::chrono::duration<double, std::milli> took = SteadyClock::now() - begin;
        const std::lock_guard lock(recorder.mutex_);
        recorder.times_[call].push_back(took.count());
      }
    } ending{*this, call};
    return body();
  }
  double Mean(const std::string& call) const {
    const auto found = times_.find(call);
    if (found == times_.end()) return 0.0;
    double sum = 0.0;
    for (const double time : found->second) sum += time;
    return sum / static_cast<double>(found->second.size());
  }
  std::vector<CallTimes> Summary() const {
    std::vector<CallTimes> summary;
    for (const auto& [call, times] : times_) {
      std::vector<double> sorted = times;
      std::sort(sorted.begin(), sorted.end());
      const auto at = [&](double share) {
        return sorted[static_cast<size_t>(share * static_cast<double>(sorted.size() - 1))];
      };
      summary.push_back(
          {call, static_cast<int64_t>(sorted.size()), Mean(call), at(0.5), at(0.99), at(1.0)});
    }
    return summary;
  }

 private:
  std::mutex mutex_;
  std::map<std::string, std::vector<double>> times_;
};

// A publication with results that no other has.
Publication NewPublication(const JobRecord& job, int artifacts) {
  Publication publication;
  for (int i = 0; i < artifacts; ++i) {
    publication.artifacts.push_back({fmt::format("views/{}.png", i),
                                     {fmt::format("{:032x}{:032x}", job.id, i + 1), 1'000},
                                     "image/png"});
  }
  publication.stage_key = fmt::format("{:064x}", job.id);
  publication.usage.seconds = 1.0;
  return publication;
}

// The calls of one attempt in their order (server/worker/attempt.cc).
void RunAttempt(JobStore& store, const JobRecord& job, int number, CallRecorder& recorder) {
  const Lease lease{job.id, job.lease_epoch};
  const WorkerRecord worker{"worker-1", 1, job.name, 1 << 20, 0};
  recorder.Time("UpdateWorker", [&] { store.UpdateWorker(worker); });
  recorder.Time("prepare: GetScene twice, GetInputs, ListChildren, FindStage", [&] {
    store.GetScene(job.scene);
    store.GetInputs(job.id);
    store.ListChildren(job.name);
    store.GetScene(job.scene);
    store.FindStage(fmt::format("{:064x}", job.id));
  });
  recorder.Time("JoinEqual", [&] { store.JoinEqual(lease, fmt::format("{:064x}", job.id)); });
  ProgressRecord progress;
  progress.total_steps = 2;
  for (progress.step = 1; progress.step <= 2; ++progress.step) {
    recorder.Time("Heartbeat", [&] { store.Heartbeat(lease, progress, {}, kLeaseMs); });
  }
  recorder.Time("SetCheckpoint", [&] {
    store.SetCheckpoint(lease, {fmt::format("{:064x}", job.id), 1'000});
  });
  const int artifacts = number % 2 == 0 ? 1 : kManyArtifacts;
  recorder.Time(artifacts == 1 ? "Publish, 1 result" : "Publish, 21 results",
                [&] { store.Publish(lease, NewPublication(job, artifacts)); });
}

// Claims and publishes as several workers at a time.
void ClaimTogether(JobStore& store, const StoreLoad& load, CallRecorder& recorder) {
  std::atomic<int> left{load.claims};
  std::vector<std::thread> callers;
  for (int i = 0; i < load.callers; ++i) {
    callers.emplace_back([&, i] {
      const std::string worker = fmt::format("worker-{}", i);
      while (left.fetch_sub(1) > 0) {
        const std::optional<JobRecord> job = recorder.Time(
            "Claim, all callers at once", [&] { return store.Claim(worker, kLeaseMs); });
        if (job) store.Publish({job->id, job->lease_epoch}, NewPublication(*job, 1));
      }
    });
  }
  for (std::thread& caller : callers) caller.join();
}

}  // namespace

StoreTimes MeasureStore(const StoreLoad& load) {
  if (load.database != "sqlite" && load.database != "postgresql") {
    throw InvalidArgument("there is no database '{}'; name sqlite or postgresql", load.database);
  }
  if (load.claims < 1 || load.callers < 1 || load.projects < 1 || load.finished < 0 ||
      load.queued < 2 * int64_t{load.claims} + kShortQueue) {
    throw InvalidArgument(
        "{} claims by one caller and as many by all need at least {} queued jobs, and a project",
        load.claims,
        2 * int64_t{load.claims} + kShortQueue);
  }
  const ScratchFolder scratch;
  StoreWithHistory history(scratch.path(), load.database == "postgresql");
  StoreTimes times;
  const auto begun = SteadyClock::now();
  history.Fill(load.finished, load.queued, load.projects);
  times.filling_seconds = std::chrono::duration<double>(SteadyClock::now() - begun).count();
  JobStore& store = history.store();
  CallRecorder recorder;
  for (int i = 0; i < load.claims; ++i) {
    const std::optional<JobRecord> job =
        recorder.Time("Claim", [&] { return store.Claim("worker-1", kLeaseMs); });
    if (!job) throw Error(ErrorCode::kInternal, "the queue has jobs, but a claim found none");
    RunAttempt(store, *job, i, recorder);
  }
  ClaimTogether(store, load, recorder);
  // What remains of a claim with a short queue is the write.
  history.ShortenQueue(kShortQueue);
  for (int i = 0; i < kShortQueue; ++i) {
    recorder.Time("Claim, short queue", [&] { store.Claim("worker-1", kLeaseMs); });
  }
  times.calls = recorder.Summary();
  ServiceTimes& service = times.service;
  constexpr double kMs = 1e-3;
  service.claim_write = kMs * recorder.Mean("Claim, short queue");
  service.claim_read = std::max(0.0, kMs * recorder.Mean("Claim") - service.claim_write);
  service.prepare_read =
      kMs * recorder.Mean("prepare: GetScene twice, GetInputs, ListChildren, FindStage");
  service.join_write = kMs * recorder.Mean("JoinEqual");
  service.publish_write = kMs * recorder.Mean("Publish, 1 result");
  service.artifact_write =
      std::max(0.0, kMs * recorder.Mean("Publish, 21 results") - service.publish_write) /
      (kManyArtifacts - 1);
  service.publish_write -= std::min(service.publish_write, service.artifact_write);
  service.heartbeat_write = kMs * recorder.Mean("Heartbeat");
  service.worker_write = kMs * recorder.Mean("UpdateWorker");
  service.checkpoint_write = kMs * recorder.Mean("SetCheckpoint");
  return times;
}

}  // namespace color3d
