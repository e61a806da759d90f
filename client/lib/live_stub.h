#pragma once
#include <grpcpp/create_channel.h>
#include "client/lib/connection.h"
#include "color3d/v1/colorizer.grpc.pb.h"
namespace color3d::client {
inline v1::ColorizerService::Stub& LiveStub(Connection& c) {
  static auto stub = v1::ColorizerService::NewStub(grpc::CreateChannel(c.address(), grpc::InsecureChannelCredentials()));
  return *stub;
}
}
