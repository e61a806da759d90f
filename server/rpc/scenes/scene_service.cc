#include "server/rpc/scenes/scene_service.h"

#include "core/base/error.h"
#include "core/catalogue/stages.h"
#include "server/planning/job_spec.h"
#include "server/planning/key_view_jobs.h"
#include "server/rpc/calls/convert.h"
#include "server/rpc/scenes/scene_validation.h"
#include "server/storage/ballast.h"

namespace color3d {
namespace {

void RequireChosenKeyView(const JobRecord& job) {
  if (job.kind != kind::kColorizeKeyView) return;
  const v1::JobSpec spec = ParseSpec(job.spec, job.name);
  if (!ColorsAdditionalKeyView(spec)) return;
  throw InvalidArgument(
      "{} colours the additional key view {}; accept a job that colours the key view which {} "
      "chose",
      job.name,
      spec.colorize_key_view().view(),
      kind::kSelectKeyView);
}

}  // namespace
grpc::ServerUnaryReactor* SceneServiceImpl::CreateScene(grpc::CallbackServerContext* context,
                                                        const v1::CreateSceneRequest* request,
                                                        v1::Scene* response) {
  return AnswerWrite(
      parts_, context, request, response, [this](const Call& call, const auto& in, v1::Scene* out) {
        const RequestKey key = IdempotencyKey("CreateScene", in);
        const SceneRecord scene = CheckedScene(in, parts_.limits);
        if (!call.store.FindRequest(key)) RequireRoomForRows(parts_, call.store, RowBytes(scene));
        *out = ToProto(call.store.CreateScene(
            scene,
            key,
            {parts_.limits.project_max_scenes, parts_.limits.project_max_uncommitted_scenes}));
      });
}

grpc::ServerUnaryReactor* SceneServiceImpl::GetScene(grpc::CallbackServerContext* context,
                                                     const v1::GetSceneRequest* request,
                                                     v1::Scene* response) {
  return AnswerRead(
      parts_, context, request, response, [](const Call& call, const auto& in, v1::Scene* out) {
        CheckName(in.name(), "scenes");
        *out = ToProto(call.store.GetScene(in.name()));
      });
}

grpc::ServerUnaryReactor* SceneServiceImpl::ListScenes(grpc::CallbackServerContext* context,
                                                       const v1::ListScenesRequest* request,
                                                       v1::ListScenesResponse* response) {
  return AnswerRead(
      parts_,
      context,
      request,
      response,
      [](const Call& call, const auto& in, v1::ListScenesResponse* out) {
        AnswerPage(
            in,
            "scenes",
            out,
            [&](int64_t before_id, int limit, bool*) {
              return call.store.ListScenes(before_id, limit);
            },
            [&](const SceneRecord& scene) { return Put(ToProto(scene), out->add_scenes()); });
      });
}

grpc::ServerUnaryReactor* SceneServiceImpl::CommitScene(grpc::CallbackServerContext* context,
                                                        const v1::CommitSceneRequest* request,
                                                        v1::Scene* response) {
  return AnswerUnary(
      parts_,
      parts_.checks,
      Role::kSubmit,
      context,
      request,
      response,
      [this, context](const Call& call, const auto& in, v1::Scene* out) {
        CheckName(in.name(), "scenes");
        const RequestKey key = IdempotencyKey("CommitScene", in);
        const SceneRecord scene = call.store.GetScene(in.name());
        if (scene.state == SceneState::kActive) {  // committed before, hence immutable
          *out = ToProto(scene);
          return;
        }
        parts_.blobs.RequireSpace(0);
        const SceneCheck check =
            CheckScene(scene, parts_.blobs, call.store, parts_.limits, [context] {
              return context->IsCancelled();
            });
        *out = ToProto(call.store.ActivateScene(scene.name, check.layout, check.photo_count, key));
      });
}

grpc::ServerUnaryReactor* SceneServiceImpl::AcceptKeyColor(grpc::CallbackServerContext* context,
                                                           const v1::AcceptKeyColorRequest* request,
                                                           v1::Scene* response) {
  return AnswerWrite(
      parts_, context, request, response, [this](const Call& call, const auto& in, v1::Scene* out) {
        CheckName(in.name(), "scenes");
        if (!in.job().empty()) {
          CheckName(in.job(), "jobs");
          RequireChosenKeyView(call.store.GetJob(in.job()));
        }
        RequireRoomForRows(parts_, call.store, 0);
        *out = ToProto(
            call.store.AcceptKeyColor(in.name(), in.job(), IdempotencyKey("AcceptKeyColor", in)));
      });
}

grpc::ServerUnaryReactor* SceneServiceImpl::DeleteScene(grpc::CallbackServerContext* context,
                                                        const v1::DeleteSceneRequest* request,
                                                        v1::DeleteSceneResponse* response) {
  return AnswerWrite(parts_,
                     context,
                     request,
                     response,
                     [this](const Call& call, const auto& in, v1::DeleteSceneResponse*) {
                       CheckName(in.name(), "scenes");
                       RetryAfterMakingRoom(parts_.make_room, [&] {
                         call.store.DeleteScene(in.name(), IdempotencyKey("DeleteScene", in));
                       });
                     });
}

}  // namespace color3d
