#include "tests/bench/scale/queue_simulation.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "core/base/error.h"
#include "core/base/random.h"
#include "tests/bench/scale/blob_set.h"
#include "tests/bench/scale/fifo_resource.h"
#include "tests/bench/scale/simulated_scenes.h"

namespace color3d {
namespace {

constexpr double kHour = 3600.0;
// Share of the workers' time.
constexpr double kNoticedLoss = 0.05;
// Calls of an attempt (server/worker/attempt.cc) beside those for its files: state of the worker,
// scene twice, inputs, graph, stage cache, equal work; publication, state of the worker.
constexpr int kPrepareCalls = 7;
constexpr int kPublishCalls = 2;
// A file is looked up and read, or written and touched.
constexpr int kCallsPerFile = 2;
constexpr SimulatedJobId kNoJob = -1;

// What happens next. A worker goes through the middle ones in order.
enum class Step : uint8_t {
  kArrival,  // of the next scene
  kReady,    // a job may be claimed
  kOffer,    // a job no longer waits for the worker that it prefers
  kClaim,
  kClaimRead,
  kClaimWrite,
  kClaimed,
  kPrepareRead,
  kPrepareWrite,
  kFetch,
  kCompute,
  kStore,
  kPublish,
  kPublishWrite,
  kDone,
  kHeartbeat,
  kHeartbeatWrite,
  kRelease,  // of a preempted job
  kEnd,      // of a worker's life
};

struct QueueEvent {
  double at;
  uint64_t order;    // of equal times
  int64_t subject;   // worker or job
  uint32_t attempt;  // of the worker; the event is void after another one has begun
  Step step;
};

struct LaterEvent {
  bool operator()(const QueueEvent& a, const QueueEvent& b) const {
    return a.at != b.at ? a.at > b.at : a.order > b.order;
  }
};

struct SimulatedWorker {
  explicit SimulatedWorker(int64_t cache_bytes, Random chance)
      : cache(cache_bytes), random(chance) {}
  BlobSet cache;
  Random random;
  uint32_t attempt = 0;
  SimulatedJobId job = kNoJob;
  double seen_at = 0.0;           // lease granted or extended
  double computing_since = -1.0;  // < 0: it is not computing
  double saved_at = 0.0;
  double reported_at = 0.0;
};

double Percentile(std::vector<float>& values, double share) {
  if (values.empty()) return 0.0;
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(
                                          share * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

class QueueSimulation {
 public:
  explicit QueueSimulation(const QueueModel& model);
  QueueResult Run();

 private:
  SimulatedWorker& WorkerOf(const QueueEvent& event) {
    return workers_[static_cast<size_t>(event.subject)];
  }

  void At(double time, int64_t subject, Step step, uint32_t attempt = 0) {
    events_.push({time, ++order_, subject, attempt, step});
  }
  // The next step of the same attempt.
  void Then(double time, const QueueEvent& event, Step step) {
    At(time, event.subject, step, event.attempt);
  }
  void Handle(const QueueEvent& event);
  void Claim(const QueueEvent& event);
  void Fetch(const QueueEvent& event);
  void BeginComputing(const QueueEvent& event);
  void Store(const QueueEvent& event);
  void Beat(const QueueEvent& event);
  void FinishJob(const QueueEvent& event);
  void BeginLife(int64_t worker);
  void EndLife(const QueueEvent& event);
  void LoseJob(SimulatedWorker& worker);
  // Returns when a request of a worker, which waits for it, is done.
  double Wait(FifoResource& resource, double seconds) {
    const double done = resource.Serve(now_, seconds);
    resource.AddWait(done - now_);
    return done;
  }
  // Returns when the bytes have passed link, blobs and server, with the calls for their files.
  double Move(int64_t bytes, int files, bool is_awaited = true);
  QueueResult Summarize();

  const QueueModel& model_;
  SimulatedScenes scenes_;
  double now_ = 0.0;
  uint64_t order_ = 0;
  std::priority_queue<QueueEvent, std::vector<QueueEvent>, LaterEvent> events_;
  std::vector<SimulatedWorker> workers_;
  Random arrivals_;
  double arrival_pause_ = 0.0;
  double computed_ = 0.0;
  int64_t done_jobs_ = 0;
  QueueResult result_;
  FifoResource writer_, readers_, cpu_, link_, blobs_;
};

QueueSimulation::QueueSimulation(const QueueModel& model)
    : model_(model),
      scenes_(model),
      arrivals_(model.seed, 1),
      writer_("database writes", model.writers),
      readers_("database reads", model.readers),
      cpu_("server CPU", model.cores),
      link_("network", model.link_bytes_per_second > 0.0 ? 1 : 0),
      blobs_("blobs", model.blob_bytes_per_second > 0.0 ? 1 : 0) {
  if (model.load > 0.0) arrival_pause_ = scenes_.MeanSeconds() / (model.workers * model.load);
  workers_.reserve(static_cast<size_t>(model.workers));
  for (int i = 0; i < model.workers; ++i) {
    workers_.emplace_back(model.cache_bytes, Random(model.seed, static_cast<uint64_t>(i) + 2));
  }
}

QueueResult QueueSimulation::Run() {
  if (model_.load > 0.0) {
    At(0.0, 0, Step::kArrival);
  } else {
    while (!scenes_.AllSubmitted()) scenes_.Submit(now_);
  }
  for (int i = 0; i < model_.workers; ++i) BeginLife(i);
  while (!scenes_.AllEnded()) {
    const QueueEvent event = events_.top();
    events_.pop();
    now_ = event.at;
    ++result_.events;
    Handle(event);
  }
  return Summarize();
}

void QueueSimulation::Handle(const QueueEvent& event) {
  const ServiceTimes& times = model_.times;
  // Events of the queue and of lives are always valid.
  switch (event.step) {
    case Step::kArrival:
      scenes_.Submit(now_);
      if (!scenes_.AllSubmitted()) {
        At(now_ - arrival_pause_ * std::log(1.0 - arrivals_.NextUniform()), 0, Step::kArrival);
      }
      return;
    case Step::kReady:
      return scenes_.Queue(event.subject, now_);
    case Step::kOffer:
      return scenes_.Offer(event.subject);
    case Step::kRelease:
      return At(writer_.Serve(now_, times.publish_write), event.subject, Step::kReady);
    case Step::kEnd:
      return EndLife(event);
    default:
      break;
  }
  if (event.attempt != WorkerOf(event).attempt) return;
  switch (event.step) {
    case Step::kClaim:
      return Then(Wait(cpu_, times.call_cpu), event, Step::kClaimRead);
    case Step::kClaimRead:
      return Then(Wait(readers_, times.claim_read), event, Step::kClaimWrite);
    case Step::kClaimWrite:
      if (!scenes_.HasWork(event.subject)) return Then(now_ + model_.poll, event, Step::kClaim);
      return Then(Wait(writer_, times.claim_write), event, Step::kClaimed);
    case Step::kClaimed:
      return Claim(event);
    case Step::kPrepareRead:
      return Then(Wait(readers_, times.prepare_read), event, Step::kPrepareWrite);
    case Step::kPrepareWrite:
      return Then(Wait(writer_, times.join_write + times.worker_write), event, Step::kFetch);
    case Step::kFetch:
      return Fetch(event);
    case Step::kCompute:
      return BeginComputing(event);
    case Step::kStore:
      return Store(event);
    case Step::kPublish:
      return Then(Wait(cpu_, kPublishCalls * times.call_cpu), event, Step::kPublishWrite);
    case Step::kPublishWrite: {
      const int files = scenes_.StageOf(WorkerOf(event).job).output_files;
      const double seconds =
          times.publish_write + times.worker_write + files * times.artifact_write;
      return Then(Wait(writer_, seconds), event, Step::kDone);
    }
    case Step::kDone:
      return FinishJob(event);
    case Step::kHeartbeat:
      if (WorkerOf(event).computing_since < 0.0) return;
      return Then(cpu_.ServeBeside(now_, times.call_cpu), event, Step::kHeartbeatWrite);
    case Step::kHeartbeatWrite:
      return Beat(event);
    default:
      throw Error(ErrorCode::kInternal, "unknown step of the simulation");
  }
}

void QueueSimulation::Claim(const QueueEvent& event) {
  const std::optional<SimulatedJobId> job = scenes_.Take(event.subject, now_);
  if (!job) return Then(now_ + model_.poll, event, Step::kClaim);
  SimulatedWorker& worker = WorkerOf(event);
  worker.job = *job;
  worker.seen_at = worker.saved_at = worker.reported_at = now_;
  ++result_.attempts;
  const double cpu = kPrepareCalls * model_.times.call_cpu + model_.local_cpu;
  Then(Wait(cpu_, cpu), event, Step::kPrepareRead);
}

double QueueSimulation::Move(int64_t bytes, int files, bool is_awaited) {
  const auto size = static_cast<double>(bytes);
  FifoResource* slowest = &cpu_;
  double done = cpu_.Serve(
      now_, files * kCallsPerFile * model_.times.call_cpu + size * model_.times.byte_cpu);
  const auto pass = [&](FifoResource& resource, double bytes_per_second) {
    if (!resource.IsLimited()) return;
    const double passed = resource.Serve(now_, size / bytes_per_second);
    if (passed <= done) return;
    done = passed;
    slowest = &resource;
  };
  pass(link_, model_.link_bytes_per_second);
  pass(blobs_, model_.blob_bytes_per_second);
  if (is_awaited) slowest->AddWait(done - now_);
  return done;
}

void QueueSimulation::Fetch(const QueueEvent& event) {
  SimulatedWorker& worker = WorkerOf(event);
  const SimulatedScene& scene = scenes_.SceneOf(worker.job);
  int64_t bytes = 0;
  int files = 0;
  const auto need = [&](int64_t group, int64_t group_bytes, int group_files) {
    if (worker.cache.Use(group)) return;
    worker.cache.Add(group, group_bytes);
    bytes += group_bytes;
    files += group_files;
  };
  need(scenes_.FilesOf(worker.job), scene.bytes, scene.files);
  for (const int input : scenes_.StageOf(worker.job).inputs) {
    const SimulatedStage& stage = scene.stages[static_cast<size_t>(input)];
    need(scenes_.InputOf(worker.job, input), stage.output_bytes, stage.output_files);
  }
  result_.fetched_bytes += bytes;
  Then(Move(bytes, files) + model_.attempt_seconds, event, Step::kCompute);
}

void QueueSimulation::BeginComputing(const QueueEvent& event) {
  SimulatedWorker& worker = WorkerOf(event);
  worker.computing_since = worker.saved_at = now_;
  const double left =
      std::max(0.0, scenes_.SecondsOf(worker.job) - scenes_.SavedSeconds(worker.job));
  Then(now_ + left, event, Step::kStore);
  if (model_.progress > 0.0) Then(now_ + model_.progress, event, Step::kHeartbeat);
}

// The next heartbeat follows the answer to the present one.
void QueueSimulation::Beat(const QueueEvent& event) {
  SimulatedWorker& worker = WorkerOf(event);
  double seconds = model_.times.heartbeat_write;
  if (now_ - worker.reported_at >= model_.heartbeat) {
    worker.reported_at = now_;
    seconds += model_.times.worker_write;
  }
  const SimulatedStage& stage = scenes_.StageOf(worker.job);
  if (stage.resumes && worker.computing_since >= 0.0 &&
      now_ - worker.saved_at >= model_.checkpoint) {
    scenes_.Save(worker.job, now_ - worker.saved_at);
    worker.saved_at = now_;
    seconds += model_.times.checkpoint_write;
    Move(stage.checkpoint_bytes, 1, /*is_awaited=*/false);
    result_.stored_bytes += stage.checkpoint_bytes;
  }
  worker.seen_at = writer_.ServeBeside(now_, seconds);
  Then(worker.seen_at + model_.progress, event, Step::kHeartbeat);
}

void QueueSimulation::Store(const QueueEvent& event) {
  SimulatedWorker& worker = WorkerOf(event);
  const SimulatedStage& stage = scenes_.StageOf(worker.job);
  computed_ += now_ - worker.computing_since;
  worker.computing_since = -1.0;
  worker.cache.Add(worker.job, stage.output_bytes);
  result_.stored_bytes += stage.output_bytes;
  Then(Move(stage.output_bytes, stage.output_files), event, Step::kPublish);
}

void QueueSimulation::FinishJob(const QueueEvent& event) {
  SimulatedWorker& worker = WorkerOf(event);
  const std::optional<SimulatedJobId> next = scenes_.Finish(worker.job, event.subject, now_);
  if (next) At(now_ + model_.preference, *next, Step::kOffer);
  worker.job = kNoJob;
  ++worker.attempt;  // its heartbeats end
  ++done_jobs_;
  At(now_, event.subject, Step::kClaim, worker.attempt);
}

void QueueSimulation::BeginLife(int64_t number) {
  SimulatedWorker& worker = workers_[static_cast<size_t>(number)];
  At(now_, number, Step::kClaim, worker.attempt);
  const double ends_per_hour = model_.losses_per_hour + model_.preemptions_per_hour;
  if (ends_per_hour <= 0.0) return;
  const double life = -std::log(1.0 - worker.random.NextUniform()) * kHour / ends_per_hour;
  At(now_ + life, number, Step::kEnd, worker.attempt);
}

void QueueSimulation::EndLife(const QueueEvent& event) {
  SimulatedWorker& worker = WorkerOf(event);
  if (event.attempt == UINT32_MAX) return BeginLife(event.subject);  // the pause is over
  const double ends_per_hour = model_.losses_per_hour + model_.preemptions_per_hour;
  const bool is_lost = worker.random.NextUniform() * ends_per_hour < model_.losses_per_hour;
  if (worker.job != kNoJob) {
    if (worker.computing_since >= 0.0) computed_ += now_ - worker.computing_since;
    if (is_lost) {
      LoseJob(worker);
    } else {
      ++result_.preemptions;
      At(cpu_.Serve(now_, model_.times.call_cpu), worker.job, Step::kRelease);
    }
  }
  worker.job = kNoJob;
  worker.computing_since = -1.0;
  worker.cache.Clear();
  ++worker.attempt;
  At(now_ + model_.restart, event.subject, Step::kEnd, UINT32_MAX);
}

void QueueSimulation::LoseJob(SimulatedWorker& worker) {
  ++result_.losses;
  const int losses = scenes_.Lose(worker.job);
  if (losses == 0) return;
  const double pause = model_.retry_pause * std::ldexp(1.0, losses - 1);
  At(worker.seen_at + model_.lease + pause, worker.job, Step::kReady);
}

QueueResult QueueSimulation::Summarize() {
  QueueResult& result = result_;
  result.workers = model_.workers;
  result.finished_scenes = scenes_.finished();
  result.failed_scenes = scenes_.failed();
  result.makespan = now_;
  if (now_ > 0.0) {
    result.scenes_per_hour = static_cast<double>(result.finished_scenes) * kHour / now_;
    result.jobs_per_second = static_cast<double>(done_jobs_) / now_;
  }
  result.wait_p50 = Percentile(scenes_.waits(), 0.5);
  result.wait_p99 = Percentile(scenes_.waits(), 0.99);
  const double worker_time = std::max(1e-9, model_.workers * now_);
  const double share = std::min(1.0, computed_ / worker_time);
  result.uses.push_back({"workers", share, 0.0});
  result.bottleneck = "workers";
  double lost = 0.0, most_lost = 0.0, most_needed = 0.0;
  for (const FifoResource* resource : {&writer_, &readers_, &cpu_, &link_, &blobs_}) {
    const ResourceUse use = {
        resource->name(), resource->Share(now_), resource->waited() / worker_time};
    result.uses.push_back(use);
    lost += use.lost;
    if (use.lost > most_lost) {
      most_lost = use.lost;
      result.bottleneck = use.name;
    }
    const double needed = resource->NeededShare(now_);
    if (needed > most_needed) {
      most_needed = needed;
      result.next_bottleneck = use.name;
    }
  }
  if (lost < kNoticedLoss) result.bottleneck = "workers";
  if (most_needed > 0.0) result.most_workers = model_.workers * share / most_needed;
  return result;
}

}  // namespace

QueueResult SimulateQueue(const QueueModel& model) {
  CheckModel(model);
  return QueueSimulation(model).Run();
}

}  // namespace color3d
