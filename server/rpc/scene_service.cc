#include "server/rpc/scene_service.h"

#include <fmt/core.h>

#include <set>

#include "core/base/files.h"
#include "server/rpc/convert.h"
#include "server/rpc/scene_validation.h"
#include "server/service_error.h"

namespace color3d {
namespace {

void CheckSceneId(const std::string& id) {
  if (id.empty()) return;
  const bool good =
      id.size() >= 4 && id.size() <= 63 && id[0] >= 'a' && id[0] <= 'z' &&
      id.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-") == std::string::npos;
  if (!good) {
    throw InvalidArgument(
        "scene_id '{}' must be 4 to 63 characters of [a-z0-9-], the first a letter",
        id.substr(0, 80));
  }
}

SceneRecord ToRecord(const v1::CreateSceneRequest& request, const ServiceLimits& limits) {
  CheckSceneId(request.scene_id());
  if (request.display_name().size() > 200) {
    throw InvalidArgument("display_name has {} bytes; at most 200 are allowed",
                          request.display_name().size());
  }
  if (request.files_size() < 1 || request.files_size() > limits.max_files_per_scene) {
    throw InvalidArgument("files has {} entries; the range is 1 to {}",
                          request.files_size(),
                          limits.max_files_per_scene);
  }
  SceneRecord record;
  record.name = "scenes/" + (request.scene_id().empty() ? "s" + NewId() : request.scene_id());
  record.display_name = request.display_name();
  std::set<std::string> paths;
  for (const v1::SceneFile& file : request.files()) {
    if (!IsSafeRelativePath(file.path())) {
      throw ServiceError(
          ErrorCode::kInvalidArgument,
          "UNSAFE_PATH",
          fmt::format("the path '{}' must be relative, with '/' separators and without '..'",
                      file.path().substr(0, 200)),
          {{"files.path", file.path().substr(0, 200)}});
    }
    if (!paths.insert(file.path()).second) {
      throw InvalidArgument("the path '{}' is there twice", file.path());
    }
    record.files.push_back({file.path(), FromProto(file.digest())});
  }
  // "a" and "a/b" cannot both be files.
  for (const std::string& path : paths) {
    for (size_t slash = path.find('/'); slash != std::string::npos;
         slash = path.find('/', slash + 1)) {
      if (paths.count(path.substr(0, slash)) > 0) {
        throw InvalidArgument("'{}' is both a file and a folder", path.substr(0, slash));
      }
    }
  }
  return record;
}

}  // namespace

grpc::ServerUnaryReactor* SceneServiceImpl::CreateScene(grpc::CallbackServerContext* context,
                                                        const v1::CreateSceneRequest* request,
                                                        v1::Scene* response) {
  return AnswerWrite(
      parts_, context, request, response, [this](const Call& call, const auto& in, v1::Scene* out) {
        const RequestKey key = KeyOf("CreateScene", in);
        *out = ToProto(call.store.CreateScene(ToRecord(in, parts_.limits), key));
      });
}

grpc::ServerUnaryReactor* SceneServiceImpl::GetScene(grpc::CallbackServerContext* context,
                                                     const v1::GetSceneRequest* request,
                                                     v1::Scene* response) {
  return AnswerRead(
      parts_, context, request, response, [this](const Call& call, const auto& in, v1::Scene* out) {
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
      [this](const Call& call, const auto& in, v1::ListScenesResponse* out) {
        AnswerPage(
            in,
            "scenes",
            out,
            [&](int64_t before_id, int limit) { return call.store.ListScenes(before_id, limit); },
            [&](const SceneRecord& scene) { *out->add_scenes() = ToProto(scene); });
      });
}

grpc::ServerUnaryReactor* SceneServiceImpl::CommitScene(grpc::CallbackServerContext* context,
                                                        const v1::CommitSceneRequest* request,
                                                        v1::Scene* response) {
  return AnswerWrite(
      parts_, context, request, response, [this](const Call& call, const auto& in, v1::Scene* out) {
        CheckName(in.name(), "scenes");
        const RequestKey key = KeyOf("CommitScene", in);
        const SceneRecord scene = call.store.GetScene(in.name());
        if (scene.state == SceneState::kActive) {  // committed before: immutable, nothing to check
          *out = ToProto(scene);
          return;
        }
        const SceneCheck check = CheckScene(scene, parts_.blobs, call.store, parts_.limits);
        *out = ToProto(call.store.ActivateScene(scene.name, check.layout, check.photo_count, key));
      });
}

grpc::ServerUnaryReactor* SceneServiceImpl::AcceptKeyColor(grpc::CallbackServerContext* context,
                                                           const v1::AcceptKeyColorRequest* request,
                                                           v1::Scene* response) {
  return AnswerWrite(
      parts_, context, request, response, [this](const Call& call, const auto& in, v1::Scene* out) {
        CheckName(in.name(), "scenes");
        if (!in.job().empty()) CheckName(in.job(), "jobs");
        *out = ToProto(call.store.AcceptKeyColor(in.name(), in.job(), KeyOf("AcceptKeyColor", in)));
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
                       call.store.DeleteScene(in.name(), KeyOf("DeleteScene", in));
                     });
}

}  // namespace color3d
