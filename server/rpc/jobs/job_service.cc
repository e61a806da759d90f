#include "server/rpc/jobs/job_service.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <set>

#include "core/catalogue/scene_files.h"
#include "core/catalogue/stages.h"
#include "server/access/notify_targets.h"
#include "server/base/service_error.h"
#include "server/planning/plan_scenes.h"
#include "server/planning/planner.h"
#include "server/planning/spec_check.h"
#include "server/planning/spec_names.h"
#include "server/rpc/calls/convert.h"
#include "server/rpc/jobs/job_log_stream.h"
#include "server/storage/ballast.h"

namespace color3d {
namespace {

// Size of the rows of a graph, before it is known which of its blobs the project holds.
int64_t EstimateRowBytes(const NewGraph& graph) {
  int64_t bytes = 0;
  for (const NewJob& job : graph.jobs) {
    JobRecord record;
    record.spec = job.spec;
    record.skip_reason = job.skip_reason;
    record.notify_url = graph.notify_url;
    bytes += RowBytes(record, job.inputs.size() + job.input_jobs.size(), job.blobs.size());
  }
  return bytes;
}

void CheckBlobs(const RpcParts& parts, const ProjectStore& store, const v1::JobSpec& spec) {
  std::vector<FieldViolation> missing;
  for (const FileDigest& digest : SpecBlobs(spec)) {
    if (!HasBlob(parts, store, digest)) {
      missing.push_back(
          {digest.sha256, fmt::format("is not stored with {} bytes", digest.size_bytes)});
    }
  }
  if (missing.empty()) return;
  throw ServiceError(ErrorCode::kFailedPrecondition,
                     ErrorReason::kBlobMissing,
                     fmt::format("the spec names {} blobs that are not uploaded, the first is {}; "
                                 "upload them and try again",
                                 missing.size(),
                                 missing[0].field),
                     missing);
}

// Returns the jobs named in spec.inputs and their children.
std::vector<JobRecord> LoadInputs(const ProjectStore& store, const v1::JobSpec& spec) {
  if (spec.inputs_size() > 100) {
    throw InvalidArgument("spec.inputs has {} entries; at most 100 are allowed",
                          spec.inputs_size());
  }
  std::vector<JobRecord> inputs;
  std::set<std::string> seen;
  for (const std::string& name : spec.inputs()) {
    CheckName(name, "jobs");
    if (!seen.insert(name).second) continue;
    inputs.push_back(store.GetJob(name));
    for (JobRecord& child : store.ListChildren(name)) inputs.push_back(std::move(child));
  }
  return inputs;
}

SceneFacts FactsOf(const SceneRecord& scene) {
  return {.pictures = scene.photo_count,
          .layout = scene.layout,
          .augment_files = static_cast<int>(
              std::count_if(scene.files.begin(), scene.files.end(), [](const auto& file) {
                return IsAugmentFile(file.path);
              }))};
}

// Returns the route's colorize_key_view job, by default the accepted one of its scene, and the
// inputs of that job.
SceneRouteInputs LoadRoute(const ProjectStore& store,
                           const v1::PersonalizeScenesSpec::SceneRoute& route) {
  CheckName(route.scene(), "scenes");
  const SceneRecord scene = store.GetScene(route.scene());
  const std::string name =
      route.key_color_job().empty() ? scene.key_color_job : route.key_color_job();
  if (name.empty()) {
    throw ServiceError(
        ErrorReason::kInputMissing,
        "the scene {} has no accepted key view; accept one, or name its {} job in the "
        "route's key_color_job",
        scene.name,
        kind::kColorizeKeyView);
  }
  CheckName(name, "jobs");
  const JobRecord key_color = store.GetJob(name);
  if (key_color.kind != kind::kColorizeKeyView) {
    throw InvalidArgument("the key_color_job {} of {} is a {} job; name a {} job",
                          name,
                          scene.name,
                          key_color.kind,
                          kind::kColorizeKeyView);
  }
  SceneRouteInputs inputs{store.GetInputs(key_color), FactsOf(scene)};
  inputs.jobs.push_back(key_color);
  return inputs;
}

NewGraph PlanRequest(const ProjectStore& store, const v1::JobSpec& spec) {
  if (!spec.has_personalize_scenes()) {
    return PlanJob(spec, LoadInputs(store, spec), FactsOf(store.GetScene(spec.scene())));
  }
  std::vector<SceneRouteInputs> routes;
  for (const auto& route : spec.personalize_scenes().routes()) {
    routes.push_back(LoadRoute(store, route));
  }
  return PlanPersonalizeScenes(spec, routes);
}

JobRecord CreateJobRecord(const RpcParts& parts,
                          const Call& call,
                          const v1::CreateJobRequest& request) {
  const ProjectStore& store = call.store;
  const RequestKey key = IdempotencyKey("CreateJob", request);
  if (const auto existing = store.FindRequest(key)) return store.GetJob(*existing);
  RequireNotDraining(parts);
  if (!request.has_spec()) throw InvalidArgument("spec is required");
  v1::JobSpec spec = request.spec();
  if (spec.scene().empty() && spec.personalize_scenes().routes_size() > 0) {
    spec.set_scene(spec.personalize_scenes().routes(0).scene());
  }
  CheckName(spec.scene(), "scenes");
  const int priority = request.has_priority() ? request.priority() : 100;
  if (priority < 0 || priority > 1000) {
    throw InvalidArgument("priority is {}; the range is 0 to 1000", priority);
  }
  if (!request.notify_url().empty()) CheckNotifyUrl(request.notify_url(), parts.notify_allowed);
  // Fails at once if a lack of space would keep the job waiting.
  RequireRoomForRows(parts, store, 0);
  CheckSpec(spec);
  CheckNames(spec, parts.models);
  CheckBlobs(parts, store, spec);
  NewGraph graph = PlanRequest(store, spec);
  graph.priority = priority;
  graph.notify_url = request.notify_url();
  RequireRoomForRows(parts, store, EstimateRowBytes(graph));
  graph.trace = call.trace;
  JobRecord job = store.CreateGraph(graph, key, GetQueueLimits(parts));
  spdlog::info("[job={}{}{}] accepted {} of {} ({} jobs)",
               job.name,
               call.trace.empty() ? "" : " trace=",
               call.trace,
               job.kind,
               job.scene,
               graph.jobs.size());
  return job;
}

// Job with its place in the queue.
v1::Job ToWaitingProto(const ProjectStore& store, const JobRecord& job) {
  v1::Job proto = ToProto(job);
  const QueuePlace place = store.PlaceInQueue(job);
  proto.set_queue_position(static_cast<int>(place.position));
  proto.set_waits_for(place.waits_for);
  return proto;
}

void ListJobPage(const ProjectStore& store,
                 const v1::ListJobsRequest& request,
                 v1::ListJobsResponse* response) {
  JobFilter filter;
  if (request.parent().rfind("scenes/", 0) == 0) {
    CheckName(request.parent(), "scenes");
    filter.scene = request.parent();
  } else if (!request.parent().empty()) {
    CheckName(request.parent(), "jobs");
    filter.parent = request.parent();
  }
  AnswerPage(
      request,
      "jobs of " + request.parent(),
      response,
      [&](int64_t before_id, int limit, bool* is_cut) {
        std::vector<JobRecord> jobs = store.ListJobs(filter, before_id, limit, kListBudget);
        int64_t bytes = 0;
        for (const JobRecord& job : jobs) bytes += MemoryBytes(job);
        *is_cut = bytes >= kListBudget.bytes;
        return jobs;
      },
      [&](const JobRecord& job) { return Put(ToWaitingProto(store, job), response->add_jobs()); });
}

}  // namespace

grpc::ServerUnaryReactor* JobServiceImpl::CreateJob(grpc::CallbackServerContext* context,
                                                    const v1::CreateJobRequest* request,
                                                    v1::Job* response) {
  return AnswerWrite(
      parts_, context, request, response, [this](const Call& call, const auto& in, v1::Job* out) {
        *out = ToProto(CreateJobRecord(parts_, call, in));
      });
}

grpc::ServerUnaryReactor* JobServiceImpl::GetJob(grpc::CallbackServerContext* context,
                                                 const v1::GetJobRequest* request,
                                                 v1::Job* response) {
  return AnswerRead(
      parts_, context, request, response, [](const Call& call, const auto& in, v1::Job* out) {
        CheckName(in.name(), "jobs");
        *out = ToWaitingProto(call.store, call.store.GetJob(in.name()));
      });
}

grpc::ServerUnaryReactor* JobServiceImpl::ListJobs(grpc::CallbackServerContext* context,
                                                   const v1::ListJobsRequest* request,
                                                   v1::ListJobsResponse* response) {
  return AnswerRead(parts_,
                    context,
                    request,
                    response,
                    [](const Call& call, const auto& in, v1::ListJobsResponse* out) {
                      ListJobPage(call.store, in, out);
                    });
}

grpc::ServerUnaryReactor* JobServiceImpl::CancelJob(grpc::CallbackServerContext* context,
                                                    const v1::CancelJobRequest* request,
                                                    v1::Job* response) {
  return AnswerWrite(
      parts_, context, request, response, [this](const Call& call, const auto& in, v1::Job* out) {
        CheckName(in.name(), "jobs");
        *out = ToProto(RetryAfterMakingRoom(parts_.make_room, [&] {
          return call.store.Cancel(in.name(), IdempotencyKey("CancelJob", in));
        }));
        spdlog::info("[job={}] cancellation requested", in.name());
      });
}

grpc::ServerUnaryReactor* JobServiceImpl::RetryJob(grpc::CallbackServerContext* context,
                                                   const v1::RetryJobRequest* request,
                                                   v1::Job* response) {
  return AnswerWrite(
      parts_, context, request, response, [this](const Call& call, const auto& in, v1::Job* out) {
        CheckName(in.name(), "jobs");
        const RequestKey key = IdempotencyKey("RetryJob", in);
        RequireNotDraining(parts_);
        if (!call.store.FindRequest(key)) RequireRoomForRows(parts_, call.store, 0);
        *out = ToProto(call.store.Retry(in.name(), in.from_scratch(), key, GetQueueLimits(parts_)));
        spdlog::info("[job={}] retried", in.name());
      });
}

grpc::ServerUnaryReactor* JobServiceImpl::DeleteJob(grpc::CallbackServerContext* context,
                                                    const v1::DeleteJobRequest* request,
                                                    v1::DeleteJobResponse* response) {
  return AnswerWrite(parts_,
                     context,
                     request,
                     response,
                     [this](const Call& call, const auto& in, v1::DeleteJobResponse*) {
                       CheckName(in.name(), "jobs");
                       RetryAfterMakingRoom(parts_.make_room, [&] {
                         call.store.Delete(in.name(), IdempotencyKey("DeleteJob", in));
                       });
                     });
}

grpc::ServerUnaryReactor* JobServiceImpl::PinJob(grpc::CallbackServerContext* context,
                                                 const v1::PinJobRequest* request,
                                                 v1::Job* response) {
  return AnswerWrite(
      parts_, context, request, response, [](const Call& call, const auto& in, v1::Job* out) {
        CheckName(in.name(), "jobs");
        *out = ToProto(call.store.Pin(in.name(), in.pinned()));
      });
}

grpc::ServerWriteReactor<v1::JobLogChunk>* JobServiceImpl::ReadJobLog(
    grpc::CallbackServerContext* context, const v1::ReadJobLogRequest* request) {
  return StreamJobLog(parts_, *context, *request);
}

grpc::ServerWriteReactor<v1::JobEvent>* JobServiceImpl::WatchJobs(
    grpc::CallbackServerContext* context, const v1::WatchJobsRequest* request) {
  return hub_.Watch(*context, *request);
}

}  // namespace color3d
