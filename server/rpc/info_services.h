// color3d.v1.ColorizerService and color3d.v1.ServerService.
#pragma once

#include "color3d/v1/colorizer.grpc.pb.h"
#include "color3d/v1/server.grpc.pb.h"
#include "server/rpc/calls/rpc_parts.h"
#include "server/rpc/live/colorize_hub.h"

namespace color3d {

class ColorizerServiceImpl final : public v1::ColorizerService::CallbackService {
 public:
  ColorizerServiceImpl(const RpcParts& parts, ColorizeHub& hub) : parts_(parts), hub_(hub) {}
  grpc::ServerUnaryReactor* GetColorizer(grpc::CallbackServerContext* context,
                                         const v1::GetColorizerRequest* request,
                                         v1::Colorizer* response) override;
  grpc::ServerUnaryReactor* ListColorizers(grpc::CallbackServerContext* context,
                                           const v1::ListColorizersRequest* request,
                                           v1::ListColorizersResponse* response) override;
  grpc::ServerBidiReactor<v1::ColorizeImagesRequest, v1::ColorizeImagesResponse>* ColorizeImages(
      grpc::CallbackServerContext* context) override;

 private:
  const RpcParts& parts_;
  ColorizeHub& hub_;
};

class ServerServiceImpl final : public v1::ServerService::CallbackService {
 public:
  explicit ServerServiceImpl(const RpcParts& parts) : parts_(parts) {}
  grpc::ServerUnaryReactor* GetServerInfo(grpc::CallbackServerContext* context,
                                          const v1::GetServerInfoRequest* request,
                                          v1::ServerInfo* response) override;

 private:
  const RpcParts& parts_;
};

}  // namespace color3d
