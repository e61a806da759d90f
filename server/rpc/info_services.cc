#include "server/rpc/info_services.h"

#include "color3d/v1/colorizer.grpc.pb.h"
#include "color3d/v1/server.grpc.pb.h"
#include "core/base/memory.h"
#include "core/base/text/utf8.h"
#include "core/catalogue/stages.h"
#include "server/ops/process.h"
#include "server/planning/presets.h"
#include "server/rpc/calls/convert.h"

namespace color3d {
namespace {
using grpc::CallbackServerContext;
using grpc::ServerUnaryReactor;

void ListModels(const RpcParts& parts, v1::ServerInfo* info) {
  for (const auto& [name, file] : parts.models.files) {
    v1::ModelInfo* model = info->add_models();
    model->set_name(name);
    try {
      const FileDigest digest = parts.digests.Of(file);
      model->set_kind(GuessModelKind(file));
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

void ListWorkers(const RpcParts& parts, const Call& call, v1::ServerInfo* info) {
  for (const WorkerRecord& worker : parts.store.ListWorkers()) {
    v1::WorkerInfo* entry = info->add_workers();
    entry->set_worker_id(worker.worker_id);
    entry->set_pid(worker.pid);
    if (IsVisibleTo(call, worker.job)) entry->set_job(worker.job);
    entry->set_memory_bytes(worker.memory_bytes);
    entry->set_heartbeat_age_seconds((parts.clock() - worker.heartbeat_ms) / 1000.0);
    entry->set_machine(worker.machine);
    entry->set_release(worker.release);
    entry->set_threads(worker.threads);
    entry->set_memory_limit_bytes(worker.memory_limit_bytes);
    entry->set_simd(worker.simd);
    entry->set_cache_bytes(worker.cache_bytes);
    entry->set_cache_limit_bytes(worker.cache_limit_bytes);
    entry->set_cache_hit_bytes(worker.cache_hit_bytes);
    entry->set_cache_miss_bytes(worker.cache_miss_bytes);
    entry->set_finished_jobs(worker.finished_jobs);
  }
}

class ColorizerServiceImpl final : public v1::ColorizerService::CallbackService {
 public:
  ColorizerServiceImpl(const RpcParts& parts, ColorizeHub& hub) : parts_(parts), hub_(hub) {}

  ServerUnaryReactor* GetColorizer(CallbackServerContext* context,
                                   const v1::GetColorizerRequest* request,
                                   v1::Colorizer* response) override {
    return AnswerRead(parts_, context, request, response, [=](const Call& call) {
      CheckName(request->name(), "colorizers");
      *response =
          ToProto(call.store.GetColorizer(request->name().substr(request->name().find('/') + 1)));
    });
  }

  ServerUnaryReactor* ListColorizers(CallbackServerContext* context,
                                     const v1::ListColorizersRequest* request,
                                     v1::ListColorizersResponse* response) override {
    return AnswerRead(parts_, context, request, response, [=](const Call& call) {
      if (!request->scene().empty()) CheckName(request->scene(), "scenes");
      AnswerPage(
          *request,
          "colorizers of " + request->scene(),
          response,
          [&](int64_t before_id, int limit, bool*) {
            return call.store.ListColorizers(request->scene(), before_id, limit);
          },
          [&](const ColorizerRecord& colorizer) {
            return Put(ToProto(colorizer), response->add_colorizers());
          });
    });
  }

  grpc::ServerBidiReactor<v1::ColorizeImagesRequest, v1::ColorizeImagesResponse>* ColorizeImages(
      CallbackServerContext* context) override {
    return hub_.Open(context);
  }

 private:
  const RpcParts& parts_;
  ColorizeHub& hub_;
};

class ServerServiceImpl final : public v1::ServerService::CallbackService {
 public:
  explicit ServerServiceImpl(const RpcParts& parts) : parts_(parts) {}

  ServerUnaryReactor* GetServerInfo(CallbackServerContext* context,
                                    const v1::GetServerInfoRequest* request,
                                    v1::ServerInfo* response) override {
    return AnswerUnary(
        parts_, parts_.slow, Role::kRead, context, request, response, [=, this](const Call& call) {
          response->set_version(parts_.version);
          for (const Stage& stage : StageCatalogue()) response->add_job_kinds(stage.kind);
          v1::Limits* limits = response->mutable_limits();
          limits->set_max_blob_bytes(parts_.limits.max_blob_bytes);
          limits->set_max_files_per_scene(parts_.limits.max_files_per_scene);
          limits->set_max_pixels_per_image(parts_.limits.max_pixels_per_image);
          limits->set_max_image_side_px(parts_.limits.max_image_side_px);
          limits->set_max_unfinished_jobs(parts_.limits.max_unfinished_jobs);
          limits->set_max_chunk_bytes(parts_.limits.max_chunk_bytes);
          ListWorkers(parts_, call, response);
          ListPresets(response);
          ListModels(parts_, response);
          ListBackends(parts_, response);
          response->set_draining(parts_.draining.load());
          response->set_memory_bytes(ResidentMemoryBytes());
          response->set_disk_free_bytes(parts_.blobs.FreeBytes());
          const JobCounts counts = parts_.store.CountJobs();
          response->set_queued_jobs(counts.queued);
          response->set_running_jobs(counts.running);
          response->set_project(call.caller.project);
          response->set_role(RoleName(call.caller.role));
          *response->mutable_usage() = ToProto(call.store.Usage(), parts_.limits);
          response->set_waits_for(HoldReason(parts_));
        });
  }

 private:
  const RpcParts& parts_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeColorizerService(const RpcParts& parts, ColorizeHub& hub) {
  return std::make_unique<ColorizerServiceImpl>(parts, hub);
}

std::unique_ptr<grpc::Service> MakeServerService(const RpcParts& parts) {
  return std::make_unique<ServerServiceImpl>(parts);
}

}  // namespace color3d
