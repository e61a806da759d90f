#include "client/lib/job_watch.h"

#include <algorithm>
#include <deque>
#include <optional>
#include <thread>

#include "client/lib/names.h"
#include "core/base/mutex.h"

namespace color3d::client {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr milliseconds kTick{200};
constexpr std::chrono::seconds kPatience{60};
// The server sends a keepalive every 30 s; a stream silent for longer is broken.
constexpr std::chrono::seconds kSilence{100};
// The current state of all jobs comes first; a stream that broke earlier may have sent part of it.
constexpr std::chrono::seconds kSnapshotTime{2};
constexpr int kJobsInPage = 500;

// One WatchJobs stream, read on a thread of its own so that the caller stays responsive.
class Stream {
 public:
  Stream(v1::JobService::Stub& stub, const v1::WatchJobsRequest& request)
      : reader_(stub.WatchJobs(&context_, request)), thread_([this] { Loop(); }) {}
  ~Stream() {
    context_.TryCancel();
    {
      const MutexLock lock(mutex_);
      stopping_ = true;
    }
    changed_.NotifyAll();
    thread_.join();
  }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  // Returns the next event; nullopt after `limit` or at the end.
  std::optional<v1::JobEvent> Next(milliseconds limit) {
    MutexLock lock(mutex_);
    const auto end = steady_clock::now() + limit;
    while (events_.empty() && !ended_ && changed_.WaitUntil(mutex_, end)) continue;
    if (events_.empty()) return std::nullopt;
    v1::JobEvent event = std::move(events_.front());
    events_.pop_front();
    changed_.NotifyAll();
    return event;
  }
  // True if the stream has ended and all its events were taken.
  std::optional<grpc::Status> End() {
    const MutexLock lock(mutex_);
    if (!ended_ || !events_.empty()) return std::nullopt;
    return status_;
  }

 private:
  static constexpr size_t kMaxWaiting = 256;

  void Loop() {
    v1::JobEvent event;
    while (reader_->Read(&event)) {
      MutexLock lock(mutex_);
      events_.push_back(event);
      changed_.NotifyAll();
      // Slow consumers slow the stream down.
      while (events_.size() >= kMaxWaiting && !stopping_) changed_.Wait(mutex_);
    }
    const grpc::Status status = reader_->Finish();
    const MutexLock lock(mutex_);
    status_ = status;
    ended_ = true;
    changed_.NotifyAll();
  }

  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::JobEvent>> reader_;
  Mutex mutex_;
  CondVar changed_;
  std::deque<v1::JobEvent> events_ COLOR3D_GUARDED_BY(mutex_);
  bool stopping_ COLOR3D_GUARDED_BY(mutex_) = false;
  bool ended_ COLOR3D_GUARDED_BY(mutex_) = false;
  grpc::Status status_ COLOR3D_GUARDED_BY(mutex_);
  std::thread thread_;
};

}  // namespace

WatchEnd WatchJobs(Connection& connection,
                   const std::vector<std::string>& names,
                   const std::function<void(const v1::JobEvent&)>& on_event,
                   const std::function<bool()>& keep_going) {
  Backoff backoff(kPatience);
  FullServerWait turned_away(connection);
  const CancellationToken never;
  int64_t revision = 0;
  while (true) {
    v1::WatchJobsRequest request;
    for (const std::string& name : names) request.add_names(name);
    request.set_after_revision(revision);
    Stream stream(connection.jobs(), request);
    const auto begun = steady_clock::now();
    auto heard = begun;
    int64_t newest = revision;
    std::optional<grpc::Status> end;
    while (!(end = stream.End())) {
      if (!keep_going()) return WatchEnd::kStopped;
      const auto event = stream.Next(kTick);
      if (!event) {
        if (steady_clock::now() - heard > kSilence) break;
        continue;
      }
      heard = steady_clock::now();
      backoff.Reset();
      turned_away.Reset();
      newest = std::max(newest, event->revision());
      if (event->has_job()) on_event(*event);
    }
    if (end && end->ok()) return WatchEnd::kFinished;
    if (revision > 0 || steady_clock::now() - begun > kSnapshotTime) revision = newest;
    if (!end) continue;
    const RpcError error(*end);
    if (error.grpc_code() == grpc::StatusCode::OUT_OF_RANGE && revision > 0) {
      revision = 0;  // events in between are lost: request the current state
      continue;
    }
    const bool again = turned_away.Wait(error, keep_going);
    // A draining server may be back soon with the same jobs.
    if (!again && !error.IsTransient()) throw error;
    if (!keep_going()) return WatchEnd::kStopped;
    if (again) {
      backoff.Reset();
      continue;
    }
    if (!backoff.Wait(never)) throw error;
  }
}

v1::Job GetJob(Connection& connection, const std::string& name) {
  v1::GetJobRequest request;
  request.set_name(name);
  return connection.Call(&v1::JobService::Stub::GetJob, connection.jobs(), request);
}

v1::Scene GetScene(Connection& connection, const std::string& name) {
  v1::GetSceneRequest request;
  request.set_name(name);
  return connection.Call(&v1::SceneService::Stub::GetScene, connection.scenes(), request);
}

void ForEachJob(Connection& connection,
                const std::string& parent,
                const std::function<bool(const v1::Job&)>& visit) {
  v1::ListJobsRequest request;
  request.set_parent(parent);
  request.set_page_size(kJobsInPage);
  do {
    const auto page = connection.Call(&v1::JobService::Stub::ListJobs, connection.jobs(), request);
    for (const v1::Job& job : page.jobs()) {
      if (!visit(job)) return;
    }
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
}

v1::Job CancelJob(Connection& connection, const std::string& name) {
  v1::CancelJobRequest request;
  request.set_name(name);
  request.set_request_id(NewUuid());
  return connection.Call(&v1::JobService::Stub::CancelJob, connection.jobs(), request);
}

std::vector<v1::Job> ListChildren(Connection& connection, const std::string& name) {
  std::vector<v1::Job> jobs;
  ForEachJob(connection, name, [&](const v1::Job& job) {
    jobs.push_back(job);
    return true;
  });
  std::ranges::reverse(jobs);
  return jobs;
}

bool IsFinished(v1::Job::State state) {
  return state == v1::Job::STATE_SUCCEEDED || state == v1::Job::STATE_FAILED ||
         state == v1::Job::STATE_CANCELLED || state == v1::Job::STATE_SKIPPED;
}

}  // namespace color3d::client
