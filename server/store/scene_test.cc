#include <gtest/gtest.h>

#include "tests/support/service/any_store_fixture.h"

namespace color3d {
namespace {
class SceneTest : public AnyStoreTest {};
COLOR3D_FOR_ALL_STORES(SceneTest);

TEST_P(SceneTest, AcceptsOnlyColoredKeyViewOfScene) {
  SceneRecord other;
  other.name = "scenes/other";
  store_->CreateScene(other, {}, {});
  NewGraph graph;
  graph.scene = "scenes/test";
  graph.jobs = {Job("colorize_key_view")};
  const std::string job = store_->CreateGraph(graph, {}, kNoLimit).name;
  const auto accept = [&](const std::string& scene, const std::string& name) {
    return store_->AcceptKeyColor(scene, name, {}).key_color_job;
  };
  EXPECT_EQ(ReasonThrown([&] { accept("scenes/test", job); }), "WRONG_STATE");
  Succeed(ClaimOne());
  EXPECT_EQ(accept("scenes/test", job), job);
  EXPECT_EQ(store_->GetScene("scenes/test").key_color_job, job);
  EXPECT_THROW(accept("scenes/other", job), Error);
  EXPECT_THROW(accept("scenes/test", CreateSingle().name), Error);
  EXPECT_EQ(ReasonThrown([&] { accept("scenes/test", "jobs/0000"); }), "JOB_NOT_FOUND");
  EXPECT_EQ(ReasonThrown([&] { accept("scenes/none", job); }), "SCENE_NOT_FOUND");
  EXPECT_EQ(accept("scenes/test", ""), "");
  accept("scenes/test", job);
  store_->Delete(job, {});
  EXPECT_EQ(store_->GetScene("scenes/test").key_color_job, "") << "a job that is gone";
}

TEST_P(SceneTest, ColorizersAreListedOncePerFile) {
  NewGraph graph;
  graph.scene = "scenes/test";
  graph.jobs = {Job("personalize")};
  for (int i = 0; i < 2; ++i) {  // the second is a cached run with the same file
    store_->CreateGraph(graph, {}, kNoLimit);
    Succeed(ClaimOne(), "colorizer.c3c");
  }
  const auto colorizers = store_->ListColorizers({}, "", 0, 10);
  ASSERT_EQ(colorizers.size(), 1u);
  EXPECT_EQ(store_->GetColorizer({}, colorizers[0].digest.sha256).job, colorizers[0].job);
  EXPECT_TRUE(store_->ListColorizers({}, "scenes/other", 0, 10).empty());
  EXPECT_EQ(ReasonThrown([&] { store_->GetColorizer({}, Sha256Hex("no")); }),
            "COLORIZER_NOT_FOUND");
}

}  // namespace
}  // namespace color3d
