#include "core/stage/write_view_page.h"

#include <gtest/gtest.h>

#include "core/base/text/base64.h"
#include "core/stage/formats/artifact_io.h"
#include "core/view/view_page.h"
#include "core/zip/gzip.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

TEST_F(StageTest, ViewPageHasTheExportedFile) {
  const Scene scene = RampScene(scratch_.path(), 48, 32);
  GaussianModel model = SmallModel();
  model.confidence.assign(model.size(), 0.5f);
  StageContext context = MakeContext();
  EXPECT_FALSE(WriteViewPage(scene, 1, model, false, {}, context));
  const ExportedFile ply{artifact::kPly, "the bytes of the exported file"};
  EXPECT_EQ(WriteViewPage(scene, 1, model, false, {ply}, context), HasViewer());
  if (!HasViewer()) {
    EXPECT_NE(observer_.text.find("npm"), std::string::npos) << observer_.text;
    return;
  }
  EXPECT_EQ(context.outputs(), (std::vector<std::string>{"view.html"}));
  const std::string html = ReadFile(scratch_.path() / "out/view.html");
  EXPECT_NE(html.find(Base64(Gzip("the bytes of the exported file"))), std::string::npos);
  StageContext compressed = MakeContext();
  const ExportedFile sog{artifact::kSog, "the bytes of the smaller file"};
  ASSERT_TRUE(WriteViewPage(scene, 1, model, false, {sog}, compressed));
  EXPECT_NE(ReadFile(scratch_.path() / "out/view.html").find(Base64("the bytes of the smaller")),
            std::string::npos);
  for (const View& view : scene.views) {
    EXPECT_NE(html.find("\"name\":\"" + view.name), std::string::npos) << view.name;
  }
}

TEST_F(StageTest, ViewPageHasPhotosOfItsTimeOnly) {
  if (!HasViewer())
    GTEST_SKIP() << "skipped, because the viewer was left out of this build (no npm)";
  Scene scene = RampScene(scratch_.path(), 48, 32);
  for (int i = 0; i < 3; ++i) scene.views[i].moment = Moment{i < 2 ? 0.0 : 0.5, i % 2};
  StageContext context = MakeContext();
  const ExportedFile ply{artifact::kPly, "the bytes of the exported file"};
  for (const bool moves : {true, false}) {
    ASSERT_TRUE(WriteViewPage(scene, 1, SmallModel(), moves, {ply}, context));
    const std::string html = ReadFile(scratch_.path() / "out/view.html");
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(html.find("\"name\":\"" + scene.views[i].name) != std::string::npos,
                !moves || i < 2)
          << moves << i;
    }
  }
}

}  // namespace
}  // namespace color3d
