#include "tests/bench/scale/store_times.h"

#include <fmt/format.h>
#include <time.h>

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

double ThreadCpuMs() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

// Requires: there is one value.
double ValueAt(std::vector<double> values, double share) {
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(
                                          share * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

// Milliseconds of calls by name. Thread-safe.
class CallRecorder {
 public:
  template <typename Body>
  auto Time(const std::string& call, const Body& body) {
    struct Ending {
      CallRecorder& recorder;
      const std::string& call;
      const double cpu_before = ThreadCpuMs();
      const SteadyClock::time_point begin = SteadyClock::now();
      ~Ending() {
        const std::chrono::duration<double, std::milli> took = SteadyClock::now() - begin;
        const double cpu = ThreadCpuMs() - cpu_before;
        const std::lock_guard lock(recorder.mutex_);
        recorder.times_[call].wall.push_back(took.count());
        recorder.times_[call].cpu.push_back(cpu);
      }
    } ending{*this, call};
    return body();
  }
  double Median(const std::string& call) const {
    const auto found = times_.find(call);
    return found == times_.end() ? 0.0 : ValueAt(found->second.wall, 0.5);
  }
  std::vector<CallTimes> Summary() const {
    std::vector<CallTimes> summary;
    for (const auto& [call, times] : times_) {
      summary.push_back({call,
                         static_cast<int64_t>(times.wall.size()),
                         ValueAt(times.wall, 0.5),
                         ValueAt(times.wall, 0.99),
                         ValueAt(times.wall, 1.0),
                         ValueAt(times.cpu, 0.5),
                         ValueAt(times.cpu, 0.99)});
    }
    return summary;
  }

 private:
  struct Times {
    std::vector<double> wall;
    std::vector<double> cpu;
  };
  std::mutex mutex_;
  std::map<std::string, Times> times_;
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
  service.claim_write = kMs * recorder.Median("Claim, short queue");
  service.claim_read = std::max(0.0, kMs * recorder.Median("Claim") - service.claim_write);
  service.prepare_read =
      kMs * recorder.Median("prepare: GetScene twice, GetInputs, ListChildren, FindStage");
  service.join_write = kMs * recorder.Median("JoinEqual");
  service.publish_write = kMs * recorder.Median("Publish, 1 result");
  service.artifact_write =
      std::max(0.0, kMs * recorder.Median("Publish, 21 results") - service.publish_write) /
      (kManyArtifacts - 1);
  service.publish_write -= std::min(service.publish_write, service.artifact_write);
  service.heartbeat_write = kMs * recorder.Median("Heartbeat");
  service.worker_write = kMs * recorder.Median("UpdateWorker");
  service.checkpoint_write = kMs * recorder.Median("SetCheckpoint");
  return times;
}

}  // namespace color3d
