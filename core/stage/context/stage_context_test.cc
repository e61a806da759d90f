#include "core/stage/context/stage_context.h"

#include <gtest/gtest.h>

#include "core/base/files.h"
#include "core/catalogue/artifacts.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

TEST_F(StageTest, NamesTheStageThatWritesAMissingInput) {
  const StageContext context = MakeContext();
  try {
    context.Input(artifact::kColorizer);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kFailedPrecondition);
    EXPECT_NE(std::string(e.what()).find("personalize"), std::string::npos) << e.what();
  }
}

TEST_F(StageTest, RefusesOutputsOutsideTheFolder) {
  StageContext context = MakeContext();
  EXPECT_THROW(context.WriteOutput("../escape", "x"), Error);
  context.WriteOutput("views/a.png", "x");
  EXPECT_EQ(context.outputs(), std::vector<std::string>{"views/a.png"});
  EXPECT_EQ(ReadFile(scratch_.path() / "out/views/a.png"), "x");
}

TEST_F(StageTest, ListsModelsForAnUnknownName) {
  models_ = {{"clip", scratch_.path() / "clip"}};
  const StageContext context = MakeContext();
  EXPECT_EQ(context.Model("clip"), scratch_.path() / "clip");
  try {
    context.LoadEncoder("tiny");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kFailedPrecondition);
    EXPECT_NE(std::string(e.what()).find("it has: clip"), std::string::npos) << e.what();
  }
  EXPECT_THROW(context.Remote("none"), Error);
}

}  // namespace
}  // namespace color3d
