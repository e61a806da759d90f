#include "server/rpc/info_services.h"

#include "core/base/memory.h"
#include "core/base/text/utf8.h"
#include "core/catalogue/stages.h"
#include "server/ops/process.h"
#include "server/planning/presets.h"
#include "server/rpc/calls/convert.h"

namespace color3d {
namespace {

void ListModels(const RpcParts& parts, v1::ServerInfo* info) {
  for (const auto& [name, file] : parts.models.files) {
    v1::ModelInfo* model = info->add_models();
    model->set_name(name);
    try {
      const FileDigest digest = parts.digests.Of(file);
      model->set_kind(LooksLike(file));
      model->set_size_bytes(digest.size_bytes);
      model->set_sha256(digest.sha256);
    } catch (const Error& e) {
      model->set_problem(CleanUtf8(e.what()));
    }
  }
}

void ListPresets(v1::ServerInfo* info) {
  for (const Preset& preset : Presets()) {
    v1::PresetInfo* entry = info->add_presets();
    entry->set_name(preset.name);
    *entry->mutable_options() = preset.options;
  }
}

void ListBackends(const RpcParts& parts, v1::ServerInfo* info) {
  if (parts.models.backends.empty()) return;
  std::map<std::string, BackendState> states;
  if (parts.probe_backends) states = parts.probe_backends();
  for (const auto& [name, address] : parts.models.backends) {
    const BackendState& state = states[name];
    v1::BackendStatus* backend = info->add_backends();
    backend->set_name(name);
    backend->set_address(address);
    backend->set_reachable(state.reachable);
    backend->set_ready(state.ready);
    backend->set_description(CleanUtf8(state.description));
    for (const std::string& capability : state.capabilities) {
      backend->add_capabilities(capability);
    }
    backend->set_max_pixels(state.max_pixels);
    backend->set_problem(CleanUtf8(state.problem));
  }
}

// Workers and their jobs of other projects are shown to operators only.
bool IsVisibleTo(const Call& call, const std::string& job) {
  if (call.caller.role == Role::kAdmin || job.empty()) return true;
  try {
    call.store.GetJob(job);
    return true;
  } catch (const Error& e) {
    if (e.code() != ErrorCode::kNotFound) throw;
    return false;
  }
}

}  // namespace

grpc::ServerUnaryReactor* ColorizerServiceImpl::GetColorizer(grpc::CallbackServerContext* context,
                                                             const v1::GetColorizerRequest* request,
                                                             v1::Colorizer* response) {
  return AnswerRead(
      parts_, context, request, response, [](const Call& call, const auto& in, v1::Colorizer* out) {
        CheckName(in.name(), "colorizers");
        *out = ToProto(call.store.GetColorizer(in.name().substr(in.name().find('/') + 1)));
      });
}

grpc::ServerUnaryReactor* ColorizerServiceImpl::ListColorizers(
    grpc::CallbackServerContext* context,
    const v1::ListColorizersRequest* request,
    v1::ListColorizersResponse* response) {
  return AnswerRead(parts_,
                    context,
                    request,
                    response,
                    [](const Call& call, const auto& in, v1::ListColorizersResponse* out) {
                      if (!in.scene().empty()) CheckName(in.scene(), "scenes");
                      AnswerPage(
                          in,
                          "colorizers of " + in.scene(),
                          out,
                          [&](int64_t before_id, int limit, bool*) {
                            return call.store.ListColorizers(in.scene(), before_id, limit);
                          },
                          [&](const ColorizerRecord& colorizer) {
                            return Put(ToProto(colorizer), out->add_colorizers());
                          });
                    });
}

grpc::ServerBidiReactor<v1::ColorizeImagesRequest, v1::ColorizeImagesResponse>*
ColorizerServiceImpl::ColorizeImages(grpc::CallbackServerContext* context) {
  return hub_.Open(context);
}

grpc::ServerUnaryReactor* ServerServiceImpl::GetServerInfo(grpc::CallbackServerContext* context,
                                                           const v1::GetServerInfoRequest* request,
                                                           v1::ServerInfo* response) {
  return AnswerUnary(
      parts_,
      parts_.slow,
      Role::kRead,
      context,
      request,
      response,
      [this](const Call& call, const auto&, v1::ServerInfo* out) {
        out->set_version(parts_.version);
        for (const Stage& stage : StageCatalogue()) out->add_job_kinds(stage.kind);
        v1::Limits* limits = out->mutable_limits();
        limits->set_max_blob_bytes(parts_.limits.max_blob_bytes);
        limits->set_max_files_per_scene(parts_.limits.max_files_per_scene);
        limits->set_max_pixels_per_image(parts_.limits.max_pixels_per_image);
        limits->set_max_image_side_px(parts_.limits.max_image_side_px);
        limits->set_max_unfinished_jobs(parts_.limits.max_unfinished_jobs);
        limits->set_max_chunk_bytes(parts_.limits.max_chunk_bytes);
        for (const WorkerRecord& worker : parts_.store.ListWorkers()) {
          v1::WorkerInfo* entry = out->add_workers();
          entry->set_worker_id(worker.worker_id);
          entry->set_pid(worker.pid);
          if (IsVisibleTo(call, worker.job)) entry->set_job(worker.job);
          entry->set_memory_bytes(worker.memory_bytes);
          entry->set_heartbeat_age_seconds((parts_.clock() - worker.heartbeat_ms) / 1000.0);
        }
        ListPresets(out);
        ListModels(parts_, out);
        ListBackends(parts_, out);
        out->set_draining(parts_.draining.load());
        out->set_memory_bytes(ResidentMemoryBytes());
        out->set_disk_free_bytes(parts_.blobs.FreeBytes());
        const JobCounts counts = parts_.store.CountJobs();
        out->set_queued_jobs(counts.queued);
        out->set_running_jobs(counts.running);
        out->set_project(call.caller.project);
        out->set_role(RoleName(call.caller.role));
        *out->mutable_usage() = ToProto(call.store.Usage(), parts_.limits);
        out->set_waits_for(HoldReason(parts_));
      });
}

}  // namespace color3d
