#include "server/rpc/jobs/job_service.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "color3d/v1/job.grpc.pb.h"
#include "core/catalogue/stages.h"
#include "core/trace/trace_context.h"
#include "server/access/notify_targets.h"
#include "server/base/service_error.h"
#include "server/planning/job_plan.h"
#include "server/planning/job_spec.h"
#include "server/planning/plan_scenes.h"
#include "server/planning/planner.h"
#include "server/planning/spec_check.h"
#include "server/planning/spec_names.h"
#include "server/rpc/calls/convert.h"
#include "server/rpc/jobs/error_forecast.h"
#include "server/rpc/jobs/job_log_stream.h"
#include "server/storage/ballast.h"

namespace color3d {
namespace {
using grpc::CallbackServerContext;
using grpc::ServerUnaryReactor;

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
  SceneRouteInputs inputs{store.GetInputs(key_color), SceneFactsFrom(scene)};
  inputs.jobs.push_back(key_color);
  return inputs;
}

// Options of the import in the graph, else among the inputs.
v1::ImportSceneSpec FindImport(const NewGraph& graph, const std::vector<JobRecord>& inputs) {
  for (const NewJob& job : graph.jobs) {
    if (job.kind == kind::kImportScene) return ParseSpec(job.spec, job.kind).import_scene();
  }
  for (const JobRecord& job : inputs) {
    if (job.kind == kind::kImportScene) return ParseSpec(job.spec, job.name).import_scene();
  }
  return {};
}

NewGraph PlanRequest(const ProjectStore& store, const v1::JobSpec& spec) {
  const SceneFacts facts = SceneFactsFrom(store.GetScene(spec.scene()));
  const std::vector<JobRecord> inputs = LoadInputs(store, spec);
  NewGraph graph;
  if (spec.has_personalize_scenes()) {
    std::vector<SceneRouteInputs> routes;
    for (const auto& route : spec.personalize_scenes().routes()) {
      routes.push_back(LoadRoute(store, route));
    }
    graph = PlanPersonalizeScenes(spec, routes);
  } else {
    graph = PlanJob(spec, inputs, facts);
  }
  SetNeeds(facts, FindImport(graph, inputs), &graph);
  return graph;
}

// Throws Error{kInvalidArgument} for facts that no scene can have.
SceneFacts FactsOfCapture(const v1::CaptureFacts& capture) {
  constexpr int kMaxFiles = 10'000;  // as in CreateScene
  if (!v1::Scene::Layout_IsValid(capture.layout()) ||
      capture.layout() == v1::Scene::LAYOUT_UNSPECIFIED) {
    throw InvalidArgument("facts.layout is {}; give a value of Scene.Layout",
                          static_cast<int>(capture.layout()));
  }
  for (const auto& [name, count] : {std::pair{"photo_count", capture.photo_count()},
                                    {"augment_file_count", capture.augment_file_count()}}) {
    if (count < 0 || count > kMaxFiles) {
      throw InvalidArgument("facts.{} is {}; the range is 0 to {}", name, count, kMaxFiles);
    }
  }
  return {.pictures = capture.photo_count(),
          .layout = static_cast<CaptureLayout>(capture.layout()),
          .augment_files = capture.augment_file_count()};
}

// Seconds of the newest finished jobs of the project, of a few scenes at most, whose files are
// read. Jobs whose scene was deleted are left out.
std::vector<MeasuredJob> MeasuredJobs(const ProjectStore& store) {
  constexpr int kNewestJobs = 60;
  constexpr size_t kMostScenes = 5;
  std::vector<MeasuredJob> measured;
  std::map<std::string, std::optional<SceneFacts>> facts_of_scenes;
  for (const JobRecord& job : store.ListJobs({}, 0, kNewestJobs, kListBudget)) {
    if (job.state != JobState::kSucceeded || job.cached || job.spec.empty()) continue;
    const bool is_full = facts_of_scenes.size() >= kMostScenes;
    if (is_full && !facts_of_scenes.contains(job.scene)) continue;
    const auto [facts, is_new] = facts_of_scenes.try_emplace(job.scene);
    if (is_new) {
      try {
        facts->second = SceneFactsFrom(store.GetScene(job.scene));
      } catch (const Error& e) {
        if (e.code() != ErrorCode::kNotFound) throw;
      }
    }
    if (!facts->second) continue;
    const v1::JobSpec spec = ParseSpec(job.spec, job.name);
    if (spec.stage_case() == v1::JobSpec::STAGE_NOT_SET) continue;
    measured.push_back(
        {EstimateJobSeconds(spec, *facts->second, spec.import_scene()), job.usage.seconds});
  }
  return measured;
}

v1::JobPlan DescribeRequest(const RpcParts& parts,
                            const ProjectStore& store,
                            const v1::PlanJobRequest& request) {
  if (!request.has_spec()) throw InvalidArgument("spec is required");
  v1::JobSpec spec = request.spec();
  if (request.has_facts()) {
    if (!spec.scene().empty() || spec.inputs_size() > 0 || spec.has_personalize_scenes()) {
      throw InvalidArgument(
          "facts describe a scene that is not stored; leave out spec.scene, spec.inputs and "
          "spec.personalize_scenes, or leave out facts");
    }
    spec.set_scene("scenes/not-stored");
  } else if (spec.scene().empty() && spec.personalize_scenes().routes_size() > 0) {
    spec.set_scene(spec.personalize_scenes().routes(0).scene());
  }
  CheckName(spec.scene(), "scenes");
  CheckSpec(spec);
  CheckNames(spec, parts.models);
  const SceneFacts facts = request.has_facts() ? FactsOfCapture(request.facts())
                                               : SceneFactsFrom(store.GetScene(spec.scene()));
  const std::vector<JobRecord> inputs = LoadInputs(store, spec);
  const NewGraph graph =
      request.has_facts() ? PlanJob(spec, inputs, facts) : PlanRequest(store, spec);
  const v1::ImportSceneSpec import = FindImport(graph, inputs);
  v1::JobPlan plan = DescribeGraph(graph, facts, import, MeasureMachine(MeasuredJobs(store)));
  if (spec.has_colorize_scene()) {
    AddBudgetErrors(ForecastError(spec, store), spec, graph, facts, import, &plan);
  }
  return plan;
}

// Throws Error{kInvalidArgument} for a malformed time.
int64_t DeadlineMs(const google::protobuf::Timestamp& deadline) {
  constexpr int64_t kLastSecond = 253'402'300'799;  // of the year 9999
  if (deadline.seconds() <= 0 || deadline.seconds() > kLastSecond || deadline.nanos() < 0 ||
      deadline.nanos() > 999'999'999) {
    throw InvalidArgument("deadline is no time between 1970 and 9999: {} s and {} ns",
                          deadline.seconds(),
                          deadline.nanos());
  }
  return deadline.seconds() * 1000 + deadline.nanos() / 1'000'000;
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
  if (request.has_deadline()) graph.deadline_ms = DeadlineMs(request.deadline());
  graph.notify_url = request.notify_url();
  RequireRoomForRows(parts, store, EstimateRowBytes(graph));
  graph.trace = call.trace;
  JobRecord job = store.CreateGraph(graph, key, GetQueueLimits(parts));
  spdlog::info("[job={}{}{}] accepted {} of {} ({} jobs)",
               job.name,
               call.trace.empty() ? "" : " trace=",
               TraceIdOf(call.trace),
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

class JobServiceImpl final : public v1::JobService::CallbackService {
 public:
  JobServiceImpl(const RpcParts& parts, WatchHub& hub) : parts_(parts), hub_(hub) {}

  ServerUnaryReactor* CreateJob(CallbackServerContext* context,
                                const v1::CreateJobRequest* request,
                                v1::Job* response) override {
    return AnswerWrite(parts_, context, request, response, [=, this](const Call& call) {
      *response = ToProto(CreateJobRecord(parts_, call, *request));
    });
  }

  ServerUnaryReactor* PlanJob(CallbackServerContext* context,
                              const v1::PlanJobRequest* request,
                              v1::JobPlan* response) override {
    return AnswerRead(parts_, context, request, response, [=, this](const Call& call) {
      *response = DescribeRequest(parts_, call.store, *request);
    });
  }

  ServerUnaryReactor* GetJob(CallbackServerContext* context,
                             const v1::GetJobRequest* request,
                             v1::Job* response) override {
    return AnswerRead(parts_, context, request, response, [=](const Call& call) {
      CheckName(request->name(), "jobs");
      *response = ToWaitingProto(call.store, call.store.GetJob(request->name()));
    });
  }

  ServerUnaryReactor* ListJobs(CallbackServerContext* context,
                               const v1::ListJobsRequest* request,
                               v1::ListJobsResponse* response) override {
    return AnswerRead(parts_, context, request, response, [=](const Call& call) {
      ListJobPage(call.store, *request, response);
    });
  }

  ServerUnaryReactor* CancelJob(CallbackServerContext* context,
                                const v1::CancelJobRequest* request,
                                v1::Job* response) override {
    return AnswerWrite(parts_, context, request, response, [=, this](const Call& call) {
      CheckName(request->name(), "jobs");
      *response = ToProto(RetryAfterMakingRoom(parts_.make_room, [&] {
        return call.store.Cancel(request->name(), IdempotencyKey("CancelJob", *request));
      }));
      spdlog::info("[job={}] cancellation requested", request->name());
    });
  }

  ServerUnaryReactor* RetryJob(CallbackServerContext* context,
                               const v1::RetryJobRequest* request,
                               v1::Job* response) override {
    return AnswerWrite(parts_, context, request, response, [=, this](const Call& call) {
      CheckName(request->name(), "jobs");
      const RequestKey key = IdempotencyKey("RetryJob", *request);
      RequireNotDraining(parts_);
      if (!call.store.FindRequest(key)) RequireRoomForRows(parts_, call.store, 0);
      *response = ToProto(
          call.store.Retry(request->name(), request->from_scratch(), key, GetQueueLimits(parts_)));
      spdlog::info("[job={}] retried", request->name());
    });
  }

  ServerUnaryReactor* DeleteJob(CallbackServerContext* context,
                                const v1::DeleteJobRequest* request,
                                v1::DeleteJobResponse* response) override {
    return AnswerWrite(parts_, context, request, response, [=, this](const Call& call) {
      CheckName(request->name(), "jobs");
      RetryAfterMakingRoom(parts_.make_room, [&] {
        call.store.Delete(request->name(), IdempotencyKey("DeleteJob", *request));
      });
    });
  }

  ServerUnaryReactor* PinJob(CallbackServerContext* context,
                             const v1::PinJobRequest* request,
                             v1::Job* response) override {
    return AnswerWrite(parts_, context, request, response, [=](const Call& call) {
      CheckName(request->name(), "jobs");
      *response = ToProto(call.store.Pin(request->name(), request->pinned()));
    });
  }

  grpc::ServerWriteReactor<v1::JobLogChunk>* ReadJobLog(
      CallbackServerContext* context, const v1::ReadJobLogRequest* request) override {
    return StreamJobLog(parts_, *context, *request);
  }

  grpc::ServerWriteReactor<v1::JobEvent>* WatchJobs(CallbackServerContext* context,
                                                    const v1::WatchJobsRequest* request) override {
    return hub_.Watch(*context, *request);
  }

 private:
  const RpcParts& parts_;
  WatchHub& hub_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeJobService(const RpcParts& parts, WatchHub& hub) {
  return std::make_unique<JobServiceImpl>(parts, hub);
}

}  // namespace color3d
