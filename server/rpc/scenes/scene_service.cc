#include "server/rpc/scenes/scene_service.h"

#include "color3d/v1/scene.grpc.pb.h"
#include "core/base/error.h"
#include "core/catalogue/stages.h"
#include "server/planning/job_spec.h"
#include "server/planning/key_view_jobs.h"
#include "server/rpc/calls/convert.h"
#include "server/rpc/scenes/scene_validation.h"
#include "server/storage/ballast.h"

namespace color3d {
namespace {
using grpc::CallbackServerContext;
using grpc::ServerUnaryReactor;

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

class SceneServiceImpl final : public v1::SceneService::CallbackService {
 public:
  explicit SceneServiceImpl(const RpcParts& parts) : parts_(parts) {}

  ServerUnaryReactor* CreateScene(CallbackServerContext* context,
                                  const v1::CreateSceneRequest* request,
                                  v1::Scene* response) override {
    return AnswerWrite(parts_, context, request, response, [=, this](const Call& call) {
      const RequestKey key = IdempotencyKey("CreateScene", *request);
      const SceneRecord scene = CheckedScene(*request, parts_.limits);
      if (!call.store.FindRequest(key)) RequireRoomForRows(parts_, call.store, RowBytes(scene));
      *response = ToProto(call.store.CreateScene(
          scene,
          key,
          {parts_.limits.project_max_scenes, parts_.limits.project_max_uncommitted_scenes}));
    });
  }

  ServerUnaryReactor* GetScene(CallbackServerContext* context,
                               const v1::GetSceneRequest* request,
                               v1::Scene* response) override {
    return AnswerRead(parts_, context, request, response, [=](const Call& call) {
      CheckName(request->name(), "scenes");
      *response = ToProto(call.store.GetScene(request->name()));
    });
  }

  ServerUnaryReactor* ListScenes(CallbackServerContext* context,
                                 const v1::ListScenesRequest* request,
                                 v1::ListScenesResponse* response) override {
    return AnswerRead(parts_, context, request, response, [=](const Call& call) {
      AnswerPage(
          *request,
          "scenes",
          response,
          [&](int64_t before_id, int limit, bool*) {
            return call.store.ListScenes(before_id, limit);
          },
          [&](const SceneRecord& scene) { return Put(ToProto(scene), response->add_scenes()); });
    });
  }

  ServerUnaryReactor* CommitScene(CallbackServerContext* context,
                                  const v1::CommitSceneRequest* request,
                                  v1::Scene* response) override {
    return AnswerUnary(
        parts_,
        parts_.checks,
        Role::kSubmit,
        context,
        request,
        response,
        [=, this](const Call& call) {
          CheckName(request->name(), "scenes");
          const RequestKey key = IdempotencyKey("CommitScene", *request);
          const SceneRecord scene = call.store.GetScene(request->name());
          if (scene.state == SceneState::kActive) {  // committed before, hence immutable
            *response = ToProto(scene);
            return;
          }
          parts_.blobs.RequireSpace(0);
          const SceneCheck check =
              CheckScene(scene, parts_.blobs, call.store, parts_.limits, [context] {
                return context->IsCancelled();
              });
          *response =
              ToProto(call.store.ActivateScene(scene.name, check.layout, check.photo_count, key));
        });
  }

  ServerUnaryReactor* AcceptKeyColor(CallbackServerContext* context,
                                     const v1::AcceptKeyColorRequest* request,
                                     v1::Scene* response) override {
    return AnswerWrite(parts_, context, request, response, [=, this](const Call& call) {
      CheckName(request->name(), "scenes");
      if (!request->job().empty()) {
        CheckName(request->job(), "jobs");
        RequireChosenKeyView(call.store.GetJob(request->job()));
      }
      RequireRoomForRows(parts_, call.store, 0);
      *response = ToProto(call.store.AcceptKeyColor(
          request->name(), request->job(), IdempotencyKey("AcceptKeyColor", *request)));
    });
  }

  ServerUnaryReactor* DeleteScene(CallbackServerContext* context,
                                  const v1::DeleteSceneRequest* request,
                                  v1::DeleteSceneResponse* response) override {
    return AnswerWrite(parts_, context, request, response, [=, this](const Call& call) {
      CheckName(request->name(), "scenes");
      RetryAfterMakingRoom(parts_.make_room, [&] {
        call.store.DeleteScene(request->name(), IdempotencyKey("DeleteScene", *request));
      });
    });
  }

 private:
  const RpcParts& parts_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeSceneService(const RpcParts& parts) {
  return std::make_unique<SceneServiceImpl>(parts);
}

}  // namespace color3d
