#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

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

}  // namespace
}  // namespace color3d
