#include "server/rpc/jobs/watch_hub.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <deque>
#include <optional>
#include <set>
#include <utility>

#include "server/base/service_error.h"
#include "server/rpc/calls/convert.h"

namespace color3d {
namespace {
using SteadyClock = std::chrono::steady_clock;
// Whole jobs that wait to be written: so many, and fewer where they are long.
constexpr size_t kJobsAtOnce = 8;
constexpr ListBudget kBudgetAtOnce = {128 << 10, kMaxSpecBytes};
}  // namespace

// One stream. gRPC calls (StartWrite, Finish) are decided under the mutex and made outside it: they
// may call back into this object on the same thread. `writing_` or `finished_` marks them as
// decided.
class JobWatcher final : public grpc::ServerWriteReactor<v1::JobEvent> {
 public:
  JobWatcher(WatchHub& hub, const v1::WatchJobsRequest& request)
      : hub_(hub), parts_(hub.parts_), request_(request) {}

  // Keeps itself alive until OnDone; the executor and the hub hold references too.
  // `store`: what the caller sees, where he is `allowed` to begin.
  void Start(const std::shared_ptr<JobWatcher>& self,
             const grpc::Status& allowed,
             std::optional<ProjectStore> store) {
    self_ = self;
    hub_.Register(self);
    if (!allowed.ok()) return End(allowed);
    store_ = std::move(store);
    parts_.quick.Post([self] { self->Begin(); });
  }

  // From the poller: something happened to these jobs.
  void Poke(const std::set<int64_t>& changed_jobs) {
    {
      std::lock_guard lock(mutex_);
      bool mine = false;
      for (const int64_t id : ids_) mine = mine || changed_jobs.count(id) > 0;
      if (!mine) return;
      dirty_ = true;
    }
    Pump();
  }

  // From the poller, every round: deferred progress and keepalive.
  void Tick() {
    {
      std::lock_guard lock(mutex_);
      if (!begun_ || finished_) return;
      const auto now = SteadyClock::now();
      for (auto it = deferred_.begin(); it != deferred_.end();) {
        if (now - progress_sent_[it->first] < interval_) {
          ++it;
          continue;
        }
        progress_sent_[it->first] = now;
        Queue(std::move(it->second));
        it = deferred_.erase(it);
      }
      if (queue_.empty() && !writing_ && now - last_write_ > hub_.timing_.keepalive) {
        v1::JobEvent event;
        event.set_kind(v1::JobEvent::KIND_KEEPALIVE);
        *event.mutable_time() = ToTimestamp(parts_.clock());
        Queue(std::move(event));
      }
    }
    Pump();
  }

  void End(const grpc::Status& status) {
    {
      std::lock_guard lock(mutex_);
      if (!end_) end_ = status;
      queue_.clear();
    }
    Pump();
  }

  void OnWriteDone(bool ok) override {
    {
      std::lock_guard lock(mutex_);
      writing_ = false;
      last_write_ = SteadyClock::now();
    }
    ok ? Pump() : End(grpc::Status::CANCELLED);
  }
  void OnCancel() override { End(grpc::Status::CANCELLED); }
  void OnDone() override {
    hub_.Unregister(this);
    self_.reset();
  }

 private:
  // On the executor: checks the request, then sends the present state or goes on from a revision.
  void Begin() {
    const grpc::Status status = Guard([&] {
      place_ = parts_.streams.watches.Take(store_->project());
      const int interval =
          request_.has_min_progress_interval_ms() ? request_.min_progress_interval_ms() : 500;
      if (interval < 50 || interval > 60'000) {
        throw InvalidArgument("min_progress_interval_ms is {}; the range is 50 to 60000", interval);
      }
      if (request_.names_size() < 1 || request_.names_size() > 100) {
        throw InvalidArgument("names has {} entries; the range is 1 to 100", request_.names_size());
      }
      if (request_.after_revision() < 0) throw InvalidArgument("after_revision is negative");
      for (const std::string& name : request_.names()) CheckName(name, "jobs");
      const std::vector<int64_t> ids =
          store_->ResolveWatch({request_.names().begin(), request_.names().end()});
      JobsSnapshot snapshot;
      if (request_.after_revision() == 0) snapshot = store_->Snapshot(ids);
      std::lock_guard lock(mutex_);
      interval_ = std::chrono::milliseconds(interval);
      ids_ = ids;
      cursor_ = request_.after_revision() == 0 ? snapshot.revision : request_.after_revision();
      sent_revision_ = request_.after_revision();
      for (const JobRecord& job : snapshot.jobs) {
        QueueState({job.revision,
                    job.id,
                    EventKind::kState,
                    job.state,
                    job.attempt,
                    job.end_ms != 0 ? job.end_ms : parts_.clock()});
      }
      begun_ = true;
      dirty_ = true;
      last_write_ = SteadyClock::now();
      // Whoever goes on is told at once that he is heard, though nothing may happen for long.
      if (request_.after_revision() > 0) last_write_ -= hub_.timing_.keepalive;
    });
    status.ok() ? Pump() : End(status);
  }

  // On the executor: the next events of the watched jobs.
  void Fetch() {
    const grpc::Status status = Guard([&] {
      const std::shared_ptr<const WatchBatch> batch = hub_.batches_.After(cursor_, ids_, *store_);
      std::lock_guard lock(mutex_);
      for (const EventRecord& event : batch->events) {
        cursor_ = event.revision;
        if (event.kind == EventKind::kState) {
          deferred_.erase(event.job_id);
          QueueState(event);
        } else if (const auto job = batch->progressed.find(event.job_id);
                   job != batch->progressed.end()) {
          TakeProgress(event, job->second);
        }
      }
      if (batch->events.size() == WatchBatches::kMaxEvents) {
        dirty_ = true;
      } else if (batch->all_finished && !end_) {
        end_ = grpc::Status::OK;
      }
    });
    {
      std::lock_guard lock(mutex_);
      fetching_ = false;
    }
    status.ok() ? Pump() : End(status);
  }

  // On the executor: the jobs of the states that are to be written next. Those behind them wait as
  // what they are in the table of events, so that a reader who is slow holds few whole jobs.
  void Load() {
    const grpc::Status status = Guard([&] {
      std::vector<int64_t> wanted;
      {
        std::lock_guard lock(mutex_);
        for (size_t i = 0; i < std::min(kJobsAtOnce, queue_.size()); ++i) {
          if (!queue_[i].state) continue;
          const int64_t id = queue_[i].state->job_id;
          if (std::ranges::find(wanted, id) == wanted.end()) wanted.push_back(id);
        }
      }
      LoadedJobs loaded = store_->LoadJobs(wanted, kBudgetAtOnce);
      wanted.resize(loaded.looked_for);
      std::map<int64_t, JobRecord> jobs;
      for (JobRecord& job : loaded.jobs) {
        const int64_t id = job.id;
        jobs.emplace(id, std::move(job));
      }
      std::lock_guard lock(mutex_);
      // What was queued meanwhile is behind; nothing with a state in front was taken.
      for (size_t i = 0; i < std::min(kJobsAtOnce, queue_.size());) {
        Item& item = queue_[i];
        const auto job = item.state ? jobs.find(item.state->job_id) : jobs.end();
        if (job != jobs.end()) {
          item = {StateEvent(Then(job->second, *item.state), *item.state), std::nullopt};
        } else if (item.state && std::ranges::find(wanted, item.state->job_id) !=
                                     wanted.end()) {  // it was deleted
          queue_.erase(queue_.begin() + static_cast<std::ptrdiff_t>(i));
          continue;
        }
        ++i;
      }
    });
    {
      std::lock_guard lock(mutex_);
      loading_ = false;
    }
    status.ok() ? Pump() : End(status);
  }

  // The job at the time of the event, as far as it is known.
  static JobRecord Then(const JobRecord& job, const EventRecord& event) {
    JobRecord then = job;
    if (then.state != event.state) {  // it has moved on since; what came later is not shown yet
      then.state = event.state;
      then.artifacts.clear();
      then.error.reset();
      then.end_ms = 0;
    }
    then.attempt = event.attempt;
    return then;
  }

  // With the mutex held.
  void TakeProgress(const EventRecord& event, const JobRecord& job) {
    v1::JobEvent progress;
    progress.set_revision(event.revision);
    progress.set_kind(v1::JobEvent::KIND_PROGRESS);
    *progress.mutable_time() = ToTimestamp(event.time_ms);
    *progress.mutable_job() = ToProgressProto(job);
    const auto now = SteadyClock::now();
    if (now - progress_sent_[job.id] < interval_) {
      deferred_[job.id] = std::move(progress);
    } else {
      progress_sent_[job.id] = now;
      deferred_.erase(job.id);
      Queue(std::move(progress));
    }
  }

  static v1::JobEvent StateEvent(const JobRecord& job, const EventRecord& record) {
    v1::JobEvent event;
    event.set_revision(record.revision);
    event.set_kind(v1::JobEvent::KIND_STATE);
    *event.mutable_time() = ToTimestamp(record.time_ms);
    *event.mutable_job() = ToProto(job);
    event.mutable_job()->set_revision(record.revision);
    return event;
  }

  // With the mutex held. Revisions never go back: deferred progress takes the newest one sent.
  void Queue(v1::JobEvent event) {
    sent_revision_ = std::max(sent_revision_, event.revision());
    event.set_revision(sent_revision_);
    queue_.push_back({std::move(event), std::nullopt});
  }
  void QueueState(const EventRecord& event) {
    sent_revision_ = std::max(sent_revision_, event.revision);
    queue_.push_back({{}, event});
  }

  // Does the one thing that can be done next.
  void Pump() {
    enum class Next { kNothing, kWrite, kLoad, kFetch, kFinish } next = Next::kNothing;
    grpc::Status status;
    std::shared_ptr<JobWatcher> self;
    {
      std::lock_guard lock(mutex_);
      if (finished_ || writing_) return;  // self_ may be gone once finished
      self = self_;
      if (!queue_.empty() && queue_.front().state) {
        if (loading_) return;
        loading_ = true;
        next = Next::kLoad;
      } else if (!queue_.empty()) {
        current_ = std::move(queue_.front().event);
        queue_.pop_front();
        writing_ = true;
        next = Next::kWrite;
      } else if (end_) {
        finished_ = true;
        status = *end_;
        next = Next::kFinish;
      } else if (begun_ && dirty_ && !fetching_) {
        dirty_ = false;
        fetching_ = true;
        next = Next::kFetch;
      }
    }
    if (next == Next::kWrite) StartWrite(&current_);
    if (next == Next::kFinish) Finish(status);
    if (next == Next::kLoad) parts_.quick.Post([self] { self->Load(); });
    if (next == Next::kFetch) parts_.quick.Post([self] { self->Fetch(); });
  }

  WatchHub& hub_;
  const RpcParts& parts_;
  const v1::WatchJobsRequest request_;
  std::shared_ptr<JobWatcher> self_;
  StreamLimit::Place place_;

  std::mutex mutex_;
  std::vector<int64_t> ids_;  // fixed once begun_
  std::chrono::milliseconds interval_{500};
  int64_t cursor_ = 0;         // events up to here were taken
  int64_t sent_revision_ = 0;  // newest that was queued for the client
  struct Item {
    v1::JobEvent event;
    std::optional<EventRecord> state;  // its job is not loaded yet: `event` is empty
  };
  std::deque<Item> queue_;
  v1::JobEvent current_;  // being written
  std::map<int64_t, v1::JobEvent> deferred_;
  std::map<int64_t, SteadyClock::time_point> progress_sent_;
  SteadyClock::time_point last_write_;
  std::optional<grpc::Status> end_;
  std::optional<ProjectStore> store_;
  bool begun_ = false;
  bool dirty_ = false;
  bool fetching_ = false;
  bool loading_ = false;
  bool writing_ = false;
  bool finished_ = false;
};

WatchHub::WatchHub(const RpcParts& parts, WatchTiming timing)
    : parts_(parts), timing_(timing), batches_(parts.store) {
  revision_ = parts_.store.NewestRevision();
  thread_ = std::thread([this] { Loop(); });
}

WatchHub::~WatchHub() {
  Drain();
  {
    std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

grpc::ServerWriteReactor<v1::JobEvent>* WatchHub::Watch(const grpc::CallbackServerContext& context,
                                                        const v1::WatchJobsRequest& request) {
  auto watcher = std::make_shared<JobWatcher>(*this, request);
  std::optional<ProjectStore> store;
  const grpc::Status allowed = Guard([&] { store = Admit(parts_, Role::kRead, context).store; });
  watcher->Start(watcher, allowed, store);
  bool draining = false;
  {
    std::lock_guard lock(mutex_);
    draining = draining_;
  }
  if (draining) watcher->End(DrainingStatus());
  return watcher.get();
}

void WatchHub::Drain() {
  std::vector<std::shared_ptr<JobWatcher>> all;
  {
    std::lock_guard lock(mutex_);
    draining_ = true;
    for (const auto& [key, watcher] : watchers_) all.push_back(watcher);
  }
  for (const auto& watcher : all) watcher->End(DrainingStatus());
}

void WatchHub::Register(const std::shared_ptr<JobWatcher>& watcher) {
  std::lock_guard lock(mutex_);
  watchers_[watcher.get()] = watcher;
}

void WatchHub::Unregister(JobWatcher* watcher) {
  std::lock_guard lock(mutex_);
  watchers_.erase(watcher);
}

void WatchHub::Loop() {
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, timing_.poll, [this] { return stopping_; })) {
    lock.unlock();
    try {
      Poll();
    } catch (const std::exception& e) {
      spdlog::warn("cannot read job events: {}", e.what());
    }
    lock.lock();
  }
}

void WatchHub::Poll() {
  std::set<int64_t> changed;
  while (true) {
    const auto events = parts_.store.EventsSince(revision_, 500);
    for (const EventRecord& event : events) changed.insert(event.job_id);
    if (!events.empty()) revision_ = events.back().revision;
    if (events.size() < 500) break;
  }
  if (!changed.empty()) batches_.Forget();
  std::vector<std::shared_ptr<JobWatcher>> all;
  {
    std::lock_guard lock(mutex_);
    for (const auto& [key, watcher] : watchers_) all.push_back(watcher);
  }
  for (const auto& watcher : all) {
    if (!changed.empty()) watcher->Poke(changed);
    watcher->Tick();
  }
}

}  // namespace color3d
