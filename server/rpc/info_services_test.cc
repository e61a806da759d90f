#include <gtest/gtest.h>

#include "tests/support/service/rpc_fixture.h"

namespace color3d::testing {
namespace {
using InfoServicesTest = RpcTest;

TEST_F(InfoServicesTest, ListsColorizersAndServerInfo) {
  const std::string scene = client_->MakeScene().name();
  v1::JobSpec spec;
  spec.set_scene(scene);
  *spec.mutable_colorize_scene()->mutable_key_color()->mutable_image() = client_->Upload("key");
  const v1::Job root = client_->Create(spec);
  EXPECT_EQ(Work(), 12) << "all jobs except the augmentations";
  EXPECT_EQ(client_->Get(root.name()).state(), v1::Job::STATE_SUCCEEDED);
  v1::ListColorizersRequest list;
  list.set_scene(scene);
  v1::ListColorizersResponse colorizers;
  grpc::ClientContext context1;
  ASSERT_TRUE(client_->colorizers->ListColorizers(&context1, list, &colorizers).ok());
  ASSERT_EQ(colorizers.colorizers_size(), 1);
  v1::GetColorizerRequest get;
  get.set_name(colorizers.colorizers(0).name());
  v1::Colorizer colorizer;
  grpc::ClientContext context2;
  ASSERT_TRUE(client_->colorizers->GetColorizer(&context2, get, &colorizer).ok());
  EXPECT_EQ(colorizer.scene(), scene);
  grpc::ClientContext context3;
  auto stream = client_->colorizers->ColorizeImages(&context3);
  EXPECT_EQ(ReasonOfStatus(stream->Finish()), "NO_INFERENCE_WORKER");
  v1::ServerInfo info;
  grpc::ClientContext context4;
  ASSERT_TRUE(client_->server->GetServerInfo(&context4, {}, &info).ok());
  EXPECT_GT(info.memory_bytes(), 0);
  EXPECT_EQ(info.limits().max_unfinished_jobs(), 40);
  EXPECT_EQ(info.job_kinds_size(), 15);
  ASSERT_EQ(info.presets_size(), 3);
  EXPECT_EQ(info.presets(0).name(), "fast");
  EXPECT_EQ(info.presets(0).options().personalize().iterations(), 100);
}

}  // namespace
}  // namespace color3d::testing
