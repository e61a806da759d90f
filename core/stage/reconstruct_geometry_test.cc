#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
#include "tests/support/scenes/scene_writers.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

TEST_F(StageTest, ReconstructsWithoutPointsAndWithLittleMemory) {
  WriteTransformsJson(RampScene(scratch_.path(), 48, 32), scratch_.path() / "transforms.json");
  StageContext import = MakeContext();
  RunImportScene({}, import);
  EXPECT_TRUE(ImportFactsFromJson(ReadFile(scratch_.path() / "out/import.json")).random_points);
  inputs_[artifact::kScene] = scratch_.path() / "out/scene.json";
  GeometryOptions options;
  options.iterations = 2;
  StageContext plenty = MakeContext();
  RunReconstructGeometry(options, 64, plenty);
  auto plan = nlohmann::json::parse(ReadFile(scratch_.path() / "out/memory_plan.json"));
  EXPECT_EQ(plan.at("note"), "");
  EXPECT_EQ(plan.at("max_gaussians"), 5000);
  observer_.text.clear();
  memory_bytes_ = int64_t{101} << 20;
  StageContext little = MakeContext();
  RunReconstructGeometry(options, 64, little);
  plan = nlohmann::json::parse(ReadFile(scratch_.path() / "out/memory_plan.json"));
  EXPECT_LT(plan.at("max_gaussians"), 5000);
  EXPECT_NE(observer_.text.find("memory: 101 MiB may be used"), std::string::npos);
  EXPECT_LE(ParseGaussians(ReadFile(scratch_.path() / "out/geometry.c3g")).size(),
            plan.at("max_gaussians").get<size_t>());
  memory_bytes_ = 1 << 20;
  StageContext none = MakeContext();
  EXPECT_THROW(RunReconstructGeometry(options, 64, none), Error);
}

TEST_F(StageTest, WarnsOfFewerIterationsThanAsked) {
  Scene scene = RampScene(scratch_.path(), 48, 32);
  SparsePoint point;
  point.position = {0.0, 0.0, 2.0};
  point.views = {0, 1, 2};
  scene.points = {point};
  AddInput(artifact::kScene, SceneToJson(scene));
  const auto warnings = [&](GeometryOptions options) {
    observer_.text.clear();
    options.time_limit_seconds = 1e-3;
    StageContext context = MakeContext();
    RunReconstructGeometry(options, 64, context);
    return observer_.text;
  };
  EXPECT_EQ(warnings({}), "");
  EXPECT_NE(warnings({.iterations = 5000}).find("1500 iterations are done of the 5000 asked for"),
            std::string::npos);
  EXPECT_EQ(warnings({.recipe = GeometryOptions::Recipe::kPaper, .iterations = 5000}), "");
}

// Training ignores the moving regions at first.
TEST_F(StageTest, MovingRegionsAffectTraining) {
  Scene scene = RampScene(scratch_.path(), 48, 32);
  for (size_t v = 0; v < scene.views.size(); ++v) {
    scene.views[v].moment = Moment{0.1 * static_cast<double>(v), 0};
  }
  SparsePoint point;
  point.position = scene.views[0].cam_from_world.WorldFromCamera({0.0, 0.0, 2.0});
  point.views = {0, 1, 2};
  scene.points = {point};
  AddInput(artifact::kScene, SceneToJson(scene));
  GeometryOptions options;
  options.iterations = 20;
  const auto trained = [&] {
    StageContext context = MakeContext();
    RunReconstructGeometry(options, 64, context);
    return ReadFile(scratch_.path() / "out/geometry.c3g");
  };
  const std::string without = trained();
  EXPECT_EQ(trained(), without);
  for (const View& view : scene.views) {
    AddInput(ViewArtifact(artifact::kMovingRegions, view), EncodePng8(Image(12, 8, 1, 1.0f)));
  }
  EXPECT_NE(trained(), without);
}

}  // namespace
}  // namespace color3d
