#include "server/rpc/admin_service.h"

#include <spdlog/spdlog.h>

#include "color3d/v1/admin.grpc.pb.h"
#include "server/rpc/calls/convert.h"
#include "server/storage/collector.h"

namespace color3d {
namespace {
using grpc::CallbackServerContext;
using grpc::ServerUnaryReactor;

constexpr int64_t kLeastGraceSeconds = 3600;
constexpr int64_t kGraceSeconds = 24 * 3600;
constexpr int kMaxListed = 1000;

template <typename Request, typename Response, typename Body>
ServerUnaryReactor* AnswerAdmin(const RpcParts& parts,
                                CallbackServerContext* context,
                                const Request* request,
                                Response* response,
                                Body body) {
  return AnswerUnary(parts, parts.slow, Role::kAdmin, context, request, response, std::move(body));
}

void SetPause(const RpcParts& parts, const Call& call, bool on) {
  parts.store.SetHold(Hold::kPaused, on);
  spdlog::warn("{} has {} the queue", CallerName(call.caller), on ? "paused" : "resumed");
}

void CollectNow(const RpcParts& parts,
                const v1::CollectRequest& request,
                v1::CollectResponse* response) {
  const int64_t grace = request.has_grace_seconds() ? request.grace_seconds() : kGraceSeconds;
  if (grace < kLeastGraceSeconds) {
    throw InvalidArgument(
        "grace_seconds is {}; at least {} are needed, so that uploads under way keep their blobs",
        grace,
        kLeastGraceSeconds);
  }
  const auto stop = [&parts] { return parts.draining.load(); };
  const auto [blobs, unreadable] = ListBlobs(parts.blobs, stop);
  RequireNotDraining(parts);
  if (!unreadable.empty()) {
    throw Error(ErrorCode::kFailedPrecondition,
                "nothing is collected: {} folders of blobs cannot be read, the first is {}; change "
                "their owner or permissions, or check the disk",
                unreadable.size(),
                unreadable.front());
  }
  std::vector<FileDigest> gone;
  if (request.dry_run()) {
    for (const StoredBlob& blob : DueBlobsSoFar(parts.chores, blobs, std::chrono::seconds(grace))) {
      gone.push_back(blob.digest);
    }
  } else {
    const auto due = DueBlobs(parts.chores, blobs, std::chrono::seconds(grace));
    gone = RemoveDue(parts.chores, parts.blobs, due, stop);
  }
  response->set_blobs(static_cast<int>(gone.size()));
  int64_t bytes = 0;
  for (const FileDigest& blob : gone) {
    bytes += blob.size_bytes;
    if (response->digests_size() < kMaxListed) *response->add_digests() = ToProto(blob);
  }
  response->set_bytes(bytes);
}

// `now_ms`: by the server's clock.
v1::QueuedJob ToQueuedProto(const JobRecord& job, int64_t now_ms) {
  const int64_t since_ms = job.state == JobState::kRunning ? job.start_ms : job.queued_since_ms;
  v1::QueuedJob entry;
  entry.set_name(job.name);
  entry.set_parent(job.parent);
  entry.set_kind(job.kind);
  entry.set_project(job.project);
  entry.set_priority(job.priority);
  entry.set_state(StateToProto(job.state));
  entry.set_worker(job.state == JobState::kRunning ? job.worker : job.preferred_worker);
  entry.set_seconds(since_ms == 0 ? 0.0 : static_cast<double>(now_ms - since_ms) / 1000.0);
  entry.set_memory_bytes(job.needs.memory_bytes);
  if (job.deadline_ms != kNoDeadline) *entry.mutable_deadline() = ToTimestamp(job.deadline_ms);
  return entry;
}

void DescribeQueue(const RpcParts& parts,
                   const v1::ListQueueRequest& request,
                   v1::ListQueueResponse* response) {
  constexpr int kWaiting = 50;
  const int asked = request.max_waiting_jobs();
  if (asked < 0 || asked > kMaxListed) {
    throw InvalidArgument("max_waiting_jobs is {}; the range is 1 to {}", asked, kMaxListed);
  }
  const int64_t now = parts.clock();
  for (const JobRecord& job : parts.store.ListQueue(asked == 0 ? kWaiting : asked)) {
    v1::QueuedJob* entry = response->add_jobs();
    *entry = ToQueuedProto(job, now);
    if (job.state == JobState::kQueued) {
      entry->set_waits_for(parts.store.WaitsFor(job));
    }
  }
  const JobCounts counts = parts.store.CountJobs();
  response->set_waiting_jobs(counts.queued - counts.blocked);
  response->set_blocked_jobs(counts.blocked);
  if (counts.oldest_queued_ms != 0) {
    response->set_longest_wait_seconds(static_cast<double>(now - counts.oldest_queued_ms) / 1000.0);
  }
  response->set_waits_for(HoldReason(parts));
}

class AdminServiceImpl final : public v1::AdminService::CallbackService {
 public:
  explicit AdminServiceImpl(const RpcParts& parts) : parts_(parts) {}

  ServerUnaryReactor* PauseQueue(CallbackServerContext* context,
                                 const v1::PauseQueueRequest* request,
                                 v1::PauseQueueResponse* response) override {
    return AnswerAdmin(parts_, context, request, response, [=, this](const Call& call) {
      SetPause(parts_, call, true);
    });
  }

  ServerUnaryReactor* ResumeQueue(CallbackServerContext* context,
                                  const v1::ResumeQueueRequest* request,
                                  v1::ResumeQueueResponse* response) override {
    return AnswerAdmin(parts_, context, request, response, [=, this](const Call& call) {
      SetPause(parts_, call, false);
    });
  }

  ServerUnaryReactor* Drain(CallbackServerContext* context,
                            const v1::DrainRequest* request,
                            v1::DrainResponse* response) override {
    return AnswerAdmin(parts_, context, request, response, [=, this](const Call& call) {
      spdlog::warn("{} drains the server", CallerName(call.caller));
      parts_.drain();
    });
  }

  ServerUnaryReactor* KillJob(CallbackServerContext* context,
                              const v1::KillJobRequest* request,
                              v1::Job* response) override {
    return AnswerAdmin(parts_, context, request, response, [=, this](const Call& call) {
      CheckName(request->name(), "jobs");
      JobRecord job = parts_.store.Kill(request->name());
      spdlog::warn("[job={}] killed by {}", job.name, CallerName(call.caller));
      job.scene = PublicScene(job.scene);
      *response = ToProto(job);
    });
  }

  ServerUnaryReactor* Collect(CallbackServerContext* context,
                              const v1::CollectRequest* request,
                              v1::CollectResponse* response) override {
    return AnswerAdmin(parts_, context, request, response, [=, this](const Call&) {
      CollectNow(parts_, *request, response);
    });
  }

  ServerUnaryReactor* ListProjects(CallbackServerContext* context,
                                   const v1::ListProjectsRequest* request,
                                   v1::ListProjectsResponse* response) override {
    return AnswerAdmin(parts_, context, request, response, [=, this](const Call&) {
      for (const ProjectRecord& project : parts_.store.ListProjects()) {
        *response->add_projects() = ToProto(project, parts_.limits);
      }
    });
  }

  ServerUnaryReactor* SetProjectWeight(CallbackServerContext* context,
                                       const v1::SetProjectWeightRequest* request,
                                       v1::ProjectUsage* response) override {
    return AnswerAdmin(parts_, context, request, response, [=, this](const Call& call) {
      if (!request->project().empty()) CheckProject(request->project());
      if (request->weight() < 1 || request->weight() > kMaxProjectWeight) {
        throw InvalidArgument(
            "weight is {}; the range is 1 to {}", request->weight(), kMaxProjectWeight);
      }
      *response = ToProto(parts_.store.SetProjectWeight(request->project(), request->weight()),
                          parts_.limits);
      spdlog::warn("{} has set the weight of the project '{}' to {}",
                   CallerName(call.caller),
                   request->project(),
                   request->weight());
    });
  }

  ServerUnaryReactor* ListQueue(CallbackServerContext* context,
                                const v1::ListQueueRequest* request,
                                v1::ListQueueResponse* response) override {
    return AnswerAdmin(parts_, context, request, response, [=, this](const Call&) {
      DescribeQueue(parts_, *request, response);
    });
  }

 private:
  const RpcParts& parts_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeAdminService(const RpcParts& parts) {
  return std::make_unique<AdminServiceImpl>(parts);
}

}  // namespace color3d
