#include "core/stage/formats/views_checkpoint.h"

#include <gtest/gtest.h>

#include "core/image/codec.h"
#include "core/stage/formats/artifact_io.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

constexpr int kWidth = 20, kHeight = 16;

class ViewsCheckpointTest : public StageTest {
 protected:
  static FusedColor ColorOf(int view) {
    return {Image(kWidth, kHeight, 2, 10.0f * static_cast<float>(view)),
            Image(kWidth, kHeight, 3, 0.25f * static_cast<float>(view))};
  }
  std::string Output(const char* artifact, int view) const {
    return ReadFile(scratch_.path() / "out" / ViewArtifact(artifact, scene_.views[view]));
  }

  const Scene scene_ = RampScene(scratch_.path(), kWidth, kHeight);
};

TEST_F(ViewsCheckpointTest, RestoresFinishedViews) {
  DyingCheckpoints store;
  store.dies_at = 2;
  checkpoints_ = &store;
  StageContext context = MakeContext();
  {
    ViewsCheckpoint done(scene_, context);
    done.Add(2, ColorOf(2));
    EXPECT_THROW(done.Add(0, ColorOf(0)), Error);
  }
  const std::string ab = Output(artifact::kViewsAb, 2);
  const std::string provenance = Output(artifact::kProvenance, 2);
  std::filesystem::remove_all(scratch_.path() / "out");
  store.dies_at = 0;
  StageContext next = MakeContext();
  ViewsCheckpoint done(scene_, next);
  EXPECT_TRUE(done.WasDone(0));
  EXPECT_FALSE(done.WasDone(1));
  EXPECT_TRUE(done.WasDone(2));
  EXPECT_EQ(Output(artifact::kViewsAb, 2), ab);
  EXPECT_EQ(Output(artifact::kProvenance, 2), provenance);
  EXPECT_TRUE(observer_.text.empty()) << observer_.text;
}

TEST_F(ViewsCheckpointTest, WarnsOfDamageAndStartsAnew) {
  DyingCheckpoints store;
  store.states = {"views 1\nand then nonsense"};
  checkpoints_ = &store;
  StageContext context = MakeContext();
  const ViewsCheckpoint done(scene_, context);
  for (int view = 0; view < 3; ++view) EXPECT_FALSE(done.WasDone(view));
  EXPECT_NE(observer_.text.find("colorize_views starts afresh"), std::string::npos)
      << observer_.text;
}

}  // namespace
}  // namespace color3d
