// color3d.v1.SceneService.
#pragma once

#include "color3d/v1/scene.grpc.pb.h"
#include "server/rpc/calls/rpc_parts.h"

namespace color3d {

class SceneServiceImpl final : public v1::SceneService::CallbackService {
 public:
  explicit SceneServiceImpl(const RpcParts& parts) : parts_(parts) {}

  grpc::ServerUnaryReactor* CreateScene(grpc::CallbackServerContext* context,
                                        const v1::CreateSceneRequest* request,
                                        v1::Scene* response) override;
  grpc::ServerUnaryReactor* GetScene(grpc::CallbackServerContext* context,
                                     const v1::GetSceneRequest* request,
                                     v1::Scene* response) override;
  grpc::ServerUnaryReactor* ListScenes(grpc::CallbackServerContext* context,
                                       const v1::ListScenesRequest* request,
                                       v1::ListScenesResponse* response) override;
  grpc::ServerUnaryReactor* CommitScene(grpc::CallbackServerContext* context,
                                        const v1::CommitSceneRequest* request,
                                        v1::Scene* response) override;
  grpc::ServerUnaryReactor* AcceptKeyColor(grpc::CallbackServerContext* context,
                                           const v1::AcceptKeyColorRequest* request,
                                           v1::Scene* response) override;
  grpc::ServerUnaryReactor* DeleteScene(grpc::CallbackServerContext* context,
                                        const v1::DeleteSceneRequest* request,
                                        v1::DeleteSceneResponse* response) override;

 private:
  const RpcParts& parts_;
};

}  // namespace color3d
