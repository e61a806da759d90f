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
// Maximum number of whole jobs that wait to be written; fewer if they are large.
constexpr size_t kJobsAtOnce = 8;
constexpr ListBudget kBudgetAtOnce = {128 << 10, kMaxSpecBytes};
}  // namespace

// One stream. gRPC calls (StartWrite, Finish) are decided under the mutex but made outside of it,
// because they may call back into this object on the same thread. `writing_` or `finished_` marks
// them as decided.
class JobWatcher final : public grpc::ServerWriteReactor<v1::JobEvent> {
 public:
  JobWatcher(WatchHub& hub, const v1::WatchJobsRequest& request)
      : hub_(hub), parts_(hub.parts_), request_(request) {}

  // Keeps itself alive until OnDone; the executor and the hub hold references, too. `store`: store
  // of the caller's project. The stream fails unless `allowed` is OK.
  void Start(const std::shared_ptr<JobWatcher>& self,
             const grpc::Status& allowed,
             std::optional<ProjectStore> store) {
    self_ = self;
    hub_.Register(self);
    if (!allowed.ok()) return End(allowed);
    store_ = std::move(store);
    parts_.quick.Post([self] { self->Begin(); });
  }

  // Called by the poller when these jobs have new events.
  void OnEvents(const std::set<int64_t>& changed_jobs) {
    {
      const MutexLock lock(mutex_);
      bool mine = false;
      for (const int64_t id : ids_) mine = mine || changed_jobs.count(id) > 0;
      if (!mine) return;
      dirty_ = true;
    }
    Pump();
  }

  // Called by the poller in every round: sends deferred progress and keepalives.
  void Tick() {
    {
      const MutexLock lock(mutex_);
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
      const MutexLock lock(mutex_);
      if (!end_) end_ = status;
      queue_.clear();
    }
    Pump();
  }

  void OnWriteDone(bool ok) override {
    {
      const MutexLock lock(mutex_);
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
  // Runs on the executor: checks the request, then sends the present state or continues from a
  // revision.
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
      const MutexLock lock(mutex_);
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
      // A continued watch gets a keepalive at once, because the next event may be far away.
      if (request_.after_revision() > 0) last_write_ -= hub_.timing_.keepalive;
    });
    status.ok() ? Pump() : End(status);
  }

  // Runs on the executor: reads the next events of the watched jobs.
  void Fetch() {
    const grpc::Status status = Guard([&] {
      const std::shared_ptr<const WatchBatch> batch = hub_.batches_.After(cursor_, ids_, *store_);
      const MutexLock lock(mutex_);
      for (const EventRecord& event : batch->events) {
        cursor_ = event.revision;
        if (event.kind == EventKind::kState) {
          deferred_.erase(event.job_id);
          QueueState(event);
        } else if (const auto job = batch->progressed.find(event.job_id);
                   job != batch->progressed.end()) {
          QueueProgress(event, job->second);
        }
      }
      if (batch->events.size() == WatchBatches::kMaxEvents) {
        dirty_ = true;
      } else if (batch->all_finished && !end_) {
        end_ = grpc::Status::OK;
      }
    });
    {
      const MutexLock lock(mutex_);
      fetching_ = false;
    }
    status.ok() ? Pump() : End(status);
  }

  // Runs on the executor: loads the jobs of the next states to be written. Later entries keep only
  // their event records, so that a slow reader holds few whole jobs.
  void Load() {
    const grpc::Status status = Guard([&] {
      std::vector<int64_t> wanted;
      {
        const MutexLock lock(mutex_);
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
      const MutexLock lock(mutex_);
      // Events queued meanwhile are behind; no entry with a state was removed from the front.
      for (size_t i = 0; i < std::min(kJobsAtOnce, queue_.size());) {
        Item& item = queue_[i];
        const auto job = item.state ? jobs.find(item.state->job_id) : jobs.end();
        if (job != jobs.end()) {
          item = {StateEvent(JobAtEvent(job->second, *item.state), *item.state), std::nullopt};
        } else if (item.state && std::ranges::find(wanted, item.state->job_id) !=
                                     wanted.end()) {  // the job was deleted
          queue_.erase(queue_.begin() + static_cast<std::ptrdiff_t>(i));
          continue;
        }
        ++i;
      }
    });
    {
      const MutexLock lock(mutex_);
      loading_ = false;
    }
    status.ok() ? Pump() : End(status);
  }

  // Returns the job at the time of the event, as far as it is known.
  static JobRecord JobAtEvent(const JobRecord& job, const EventRecord& event) {
    JobRecord then = job;
    if (then.state != event.state) {  // the job has changed since; later facts are not shown yet
      then.state = event.state;
      then.artifacts.clear();
      then.error.reset();
      then.end_ms = 0;
    }
    then.attempt = event.attempt;
    return then;
  }

  void QueueProgress(const EventRecord& event, const JobRecord& job) COLOR3D_REQUIRES(mutex_) {
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

  // Revisions never decrease: deferred progress gets the newest one sent.
  void Queue(v1::JobEvent event) COLOR3D_REQUIRES(mutex_) {
    sent_revision_ = std::max(sent_revision_, event.revision());
    event.set_revision(sent_revision_);
    queue_.push_back({std::move(event), std::nullopt});
  }
  void QueueState(const EventRecord& event) COLOR3D_REQUIRES(mutex_) {
    sent_revision_ = std::max(sent_revision_, event.revision);
    queue_.push_back({{}, event});
  }

  // Starts the next possible operation.
  void Pump() {
    enum class Next { kNothing, kWrite, kLoad, kFetch, kFinish } next = Next::kNothing;
    grpc::Status status;
    std::shared_ptr<JobWatcher> self;
    {
      const MutexLock lock(mutex_);
      if (finished_ || writing_) return;  // self_ may be gone after finished_ is set
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
  std::optional<ProjectStore> store_;  // set by Start, if the caller is allowed

  Mutex mutex_;
  std::vector<int64_t> ids_;  // constant once begun_ is set
  std::chrono::milliseconds interval_ COLOR3D_GUARDED_BY(mutex_){500};
  int64_t cursor_ = 0;                                    // last event that was read
  int64_t sent_revision_ COLOR3D_GUARDED_BY(mutex_) = 0;  // newest revision queued for the client
  struct Item {
    v1::JobEvent event;
    std::optional<EventRecord> state;  // the job is not loaded yet and `event` is empty
  };
  std::deque<Item> queue_ COLOR3D_GUARDED_BY(mutex_);
  v1::JobEvent current_;  // message being written
  std::map<int64_t, v1::JobEvent> deferred_ COLOR3D_GUARDED_BY(mutex_);
  std::map<int64_t, SteadyClock::time_point> progress_sent_ COLOR3D_GUARDED_BY(mutex_);
  SteadyClock::time_point last_write_ COLOR3D_GUARDED_BY(mutex_);
  std::optional<grpc::Status> end_ COLOR3D_GUARDED_BY(mutex_);
  bool begun_ COLOR3D_GUARDED_BY(mutex_) = false;
  bool dirty_ COLOR3D_GUARDED_BY(mutex_) = false;
  bool fetching_ COLOR3D_GUARDED_BY(mutex_) = false;
  bool loading_ COLOR3D_GUARDED_BY(mutex_) = false;
  bool writing_ COLOR3D_GUARDED_BY(mutex_) = false;
  bool finished_ COLOR3D_GUARDED_BY(mutex_) = false;
};

WatchHub::WatchHub(const RpcParts& parts, WatchTiming timing)
    : parts_(parts), timing_(timing), batches_(parts.store) {
  revision_ = parts_.store.NewestRevision();
  thread_ = std::thread([this] { Loop(); });
}

WatchHub::~WatchHub() {
  Drain();
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
  }
  wake_.NotifyAll();
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
    const MutexLock lock(mutex_);
    draining = draining_;
  }
  if (draining) watcher->End(DrainingStatus());
  return watcher.get();
}

void WatchHub::Drain() {
  std::vector<std::shared_ptr<JobWatcher>> all;
  {
    const MutexLock lock(mutex_);
    draining_ = true;
    for (const auto& [key, watcher] : watchers_) all.push_back(watcher);
  }
  for (const auto& watcher : all) watcher->End(DrainingStatus());
}

void WatchHub::Register(const std::shared_ptr<JobWatcher>& watcher) {
  const MutexLock lock(mutex_);
  watchers_[watcher.get()] = watcher;
}

void WatchHub::Unregister(JobWatcher* watcher) {
  const MutexLock lock(mutex_);
  watchers_.erase(watcher);
}

void WatchHub::Loop() {
  MutexLock lock(mutex_);
  while (true) {
    const auto end = SteadyClock::now() + timing_.poll;
    while (!stopping_ && wake_.WaitUntil(mutex_, end)) continue;
    if (stopping_) return;
    lock.Unlock();
    try {
      Poll();
    } catch (const std::exception& e) {
      spdlog::warn("cannot read job events: {}", e.what());
    }
    lock.Lock();
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
    const MutexLock lock(mutex_);
    for (const auto& [key, watcher] : watchers_) all.push_back(watcher);
  }
  for (const auto& watcher : all) {
    if (!changed.empty()) watcher->OnEvents(changed);
    watcher->Tick();
  }
}

}  // namespace color3d
