#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

TEST_F(StageTest, RefusesHeldOutManualKeyView) {
  const Scene scene = RampScene(scratch_.path(), 48, 32);
  AddInput(artifact::kScene, SceneToJson(scene));
  StageContext context = MakeContext();
  SelectKeyViewOptions options;
  options.selection.strategy = KeyViewStrategy::kManual;
  options.view = "p0.png";
  EXPECT_THROW(RunSelectKeyView(options, context), Error);
  options.view = "nowhere.png";
  EXPECT_THROW(RunSelectKeyView(options, context), Error);
  options.view = "p2";
  RunSelectKeyView(options, context);
  const auto key = nlohmann::json::parse(ReadFile(scratch_.path() / "out/key_view.json"));
  EXPECT_EQ(key.at("view"), "p2.png");
}

TEST_F(StageTest, RandomKeyViewDependsOnSeedAlone) {
  Scene scene = RampScene(scratch_.path(), 48, 32);
  AddInput(artifact::kScene, SceneToJson(scene));
  SelectKeyViewOptions options;
  options.selection.strategy = KeyViewStrategy::kRandom;
  options.selection.outlier_guard = false;
  const auto select = [&](uint64_t seed) {
    seed_ = seed;
    StageContext context = MakeContext();
    RunSelectKeyView(options, context);
    const auto key = nlohmann::json::parse(ReadFile(scratch_.path() / "out/key_view.json"));
    EXPECT_EQ(key.at("strategy"), "random");
    return key.at("view").get<std::string>();
  };
  std::set<std::string> chosen;
  for (uint64_t seed = 1; seed <= 8; ++seed) {
    chosen.insert(select(seed));
    EXPECT_EQ(select(seed), select(seed));
  }
  EXPECT_EQ(chosen, (std::set<std::string>{"p1.png", "p2.png"})) << "p0 is held out";
}

}  // namespace
}  // namespace color3d
