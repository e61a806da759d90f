#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/stage/formats/artifacts.h"
#include "core/stage/stages.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

TEST_F(StageTest, ExportWritesBothFormatsInTheWorldsFrameAndSaysWhatTheyLose) {
  Scene scene = RampScene(scratch_.path(), 48, 32);
  scene.world_from_scene_scale = 0.001;
  scene.world_offset = {1e6, 0.0, 0.0};
  AddInput(artifact::kScene, SceneToJson(scene));
  AddInput(artifact::kModel, SerializeGaussians(SmallModel()));
  StageContext context = MakeContext();
  RunExport({}, context);
  EXPECT_EQ(context.outputs(),
            (std::vector<std::string>{"scene.ply", "scene.splat", "export.json"}));
  EXPECT_NE(observer_.text.find("relative to the offset"), std::string::npos) << observer_.text;
  const std::string ply = ReadFile(scratch_.path() / "out/scene.ply");
  EXPECT_NE(ply.find("comment offset 1e+06 0 0\n"), std::string::npos);
  EXPECT_EQ(ReadFile(scratch_.path() / "out/scene.splat").size(), 9u * 32);
  const auto scores = nlohmann::json::parse(ReadFile(scratch_.path() / "out/export.json"));
  const double before = scores.at("ply").at("unrefined_psnr_db_vs_lab");
  const double after = scores.at("ply").at("psnr_db_vs_lab");
  EXPECT_GT(before, 20.0);
  EXPECT_GE(after, before);
  EXPECT_EQ(scores.at("ply").at("worst_view").get<std::string>().substr(0, 1), "p");
  StageContext again = MakeContext();
  EXPECT_THROW(RunExport({.ply = false, .splat = false}, again), Error);
}

}  // namespace
}  // namespace color3d
