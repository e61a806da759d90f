#include "server/rpc/job_service.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <algorithm>

#include "core/catalogue/scene_files.h"
#include "core/catalogue/stages.h"
#include "server/planning/plan_scenes.h"
#include "server/planning/planner.h"
#include "server/planning/spec_check.h"
#include "server/planning/spec_names.h"
#include "server/rpc/convert.h"
#include "server/service_error.h"

namespace color3d {
namespace {

void RequireNotDraining(const RpcParts& parts) {
  if (!parts.draining.load()) return;
  throw ServiceError(
      ErrorCode::kUnavailable,
      "DRAINING",
      "the server is shutting down and takes no new jobs; try again when it is back");
}

void CheckBlobs(const RpcParts& parts, const v1::JobSpec& spec) {
  std::vector<FieldViolation> missing;
  for (const FileDigest& digest : SpecBlobs(spec)) {
    if (!parts.blobs.Touch(digest)) {
      missing.push_back(
          {digest.sha256, fmt::format("is not stored with {} bytes", digest.size_bytes)});
    }
  }
  if (missing.empty()) return;
  throw ServiceError(
      ErrorCode::kFailedPrecondition,
      "BLOB_MISSING",
      fmt::format(
          "the spec names {} blobs that are not uploaded, first {}; upload them and try again",
          missing.size(),
          missing[0].field),
      missing);
}

// The jobs that spec.inputs names, with their children.
std::vector<JobRecord> LoadInputs(const RpcParts& parts, const v1::JobSpec& spec) {
  if (spec.inputs_size() > 100) {
    throw InvalidArgument("spec.inputs has {} entries; at most 100 are allowed",
                          spec.inputs_size());
  }
  std::vector<JobRecord> inputs;
  for (const std::string& name : spec.inputs()) {
    CheckName(name, "jobs");
    inputs.push_back(parts.store.GetJob(name));
    for (JobRecord& child : parts.store.ListChildren(name)) inputs.push_back(std::move(child));
  }
  return inputs;
}

SceneFacts FactsOf(const SceneRecord& scene) {
  const bool is_splat = scene.layout == StoredLayout::kSplat;
  return {.photos = is_splat ? kSplatViews : scene.photo_count,
          .has_poses = scene.layout != StoredLayout::kPhotos && scene.layout != StoredLayout::kFilm,
          .augment_files = static_cast<int>(
              std::count_if(scene.files.begin(),
                            scene.files.end(),
                            [](const auto& file) { return IsAugmentFile(file.path); })),
          .is_film = scene.layout == StoredLayout::kFilm,
          .is_splat = is_splat};
}

// The route's colorize_key_view job, by default the one that its scene's user accepted, and what it
// read.
SceneRouteInputs LoadRoute(const RpcParts& parts,
                           const v1::PersonalizeScenesSpec::SceneRoute& route) {
  CheckName(route.scene(), "scenes");
  const SceneRecord scene = parts.store.GetScene(route.scene());
  const std::string name =
      route.key_color_job().empty() ? scene.key_color_job : route.key_color_job();
  if (name.empty()) {
    throw ServiceError(
        ErrorCode::kFailedPrecondition,
        "INPUT_MISSING",
        "the scene {} has no accepted key view; accept one, or name its {} job in the "
        "route's key_color_job",
        scene.name,
        kind::kColorizeKeyView);
  }
  CheckName(name, "jobs");
  const JobRecord key_color = parts.store.GetJob(name);
  if (key_color.kind != kind::kColorizeKeyView) {
    throw InvalidArgument("the key_color_job {} of {} is a {} job; name a {} job",
                          name,
                          scene.name,
                          key_color.kind,
                          kind::kColorizeKeyView);
  }
  SceneRouteInputs inputs{parts.store.GetInputs(key_color.id), FactsOf(scene)};
  inputs.jobs.push_back(key_color);
  return inputs;
}

NewGraph PlanRequest(const RpcParts& parts, const v1::JobSpec& spec) {
  if (!spec.has_personalize_scenes()) {
    return PlanJob(spec, LoadInputs(parts, spec), FactsOf(parts.store.GetScene(spec.scene())));
  }
  std::vector<SceneRouteInputs> routes;
  for (const auto& route : spec.personalize_scenes().routes()) {
    routes.push_back(LoadRoute(parts, route));
  }
  return PlanPersonalizeScenes(spec, routes);
}

JobRecord CreateJobRecord(const RpcParts& parts, const v1::CreateJobRequest& request) {
  const RequestKey key = KeyOf("CreateJob", request);
  if (const auto existing = parts.store.FindRequest(key)) return parts.store.GetJob(*existing);
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
  CheckSpec(spec);
  CheckNames(spec, parts.models);
  CheckBlobs(parts, spec);
  NewGraph graph = PlanRequest(parts, spec);
  graph.priority = priority;
  JobRecord job = parts.store.CreateGraph(graph, key, parts.limits.max_unfinished_jobs);
  spdlog::info(
      "[job={}] accepted {} of {} ({} jobs)", job.name, job.kind, job.scene, graph.jobs.size());
  return job;
}

void ListJobPage(const RpcParts& parts,
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
      [&](int64_t before_id, int limit) { return parts.store.ListJobs(filter, before_id, limit); },
      [&](const JobRecord& job) { *response->add_jobs() = ToProto(job); });
}

}  // namespace

grpc::ServerUnaryReactor* JobServiceImpl::CreateJob(grpc::CallbackServerContext* context,
                                                    const v1::CreateJobRequest* request,
                                                    v1::Job* response) {
  return AnswerWrite(parts_, context, request, response, [this](const auto& in, v1::Job* out) {
    *out = ToProto(CreateJobRecord(parts_, in));
  });
}

grpc::ServerUnaryReactor* JobServiceImpl::GetJob(grpc::CallbackServerContext* context,
                                                 const v1::GetJobRequest* request,
                                                 v1::Job* response) {
  return AnswerRead(parts_, context, request, response, [this](const auto& in, v1::Job* out) {
    CheckName(in.name(), "jobs");
    *out = ToProto(parts_.store.GetJob(in.name()));
  });
}

grpc::ServerUnaryReactor* JobServiceImpl::ListJobs(grpc::CallbackServerContext* context,
                                                   const v1::ListJobsRequest* request,
                                                   v1::ListJobsResponse* response) {
  return AnswerRead(
      parts_, context, request, response, [this](const auto& in, v1::ListJobsResponse* out) {
        ListJobPage(parts_, in, out);
      });
}

grpc::ServerUnaryReactor* JobServiceImpl::CancelJob(grpc::CallbackServerContext* context,
                                                    const v1::CancelJobRequest* request,
                                                    v1::Job* response) {
  return AnswerWrite(parts_, context, request, response, [this](const auto& in, v1::Job* out) {
    CheckName(in.name(), "jobs");
    *out = ToProto(parts_.store.Cancel(in.name(), KeyOf("CancelJob", in)));
    spdlog::info("[job={}] cancellation asked for", in.name());
  });
}

grpc::ServerUnaryReactor* JobServiceImpl::RetryJob(grpc::CallbackServerContext* context,
                                                   const v1::RetryJobRequest* request,
                                                   v1::Job* response) {
  return AnswerWrite(parts_, context, request, response, [this](const auto& in, v1::Job* out) {
    CheckName(in.name(), "jobs");
    RequireNotDraining(parts_);
    *out = ToProto(parts_.store.Retry(
        in.name(), in.from_scratch(), KeyOf("RetryJob", in), parts_.limits.max_unfinished_jobs));
    spdlog::info("[job={}] retried", in.name());
  });
}

grpc::ServerUnaryReactor* JobServiceImpl::DeleteJob(grpc::CallbackServerContext* context,
                                                    const v1::DeleteJobRequest* request,
                                                    v1::DeleteJobResponse* response) {
  return AnswerWrite(
      parts_, context, request, response, [this](const auto& in, v1::DeleteJobResponse*) {
        CheckName(in.name(), "jobs");
        parts_.store.Delete(in.name(), KeyOf("DeleteJob", in));
      });
}

grpc::ServerWriteReactor<v1::JobEvent>* JobServiceImpl::WatchJobs(
    grpc::CallbackServerContext* context, const v1::WatchJobsRequest* request) {
  return hub_.Watch(*context, *request);
}

}  // namespace color3d
