#include "core/stage/report/view_page.h"

#include <gtest/gtest.h>

#include "core/base/base64.h"
#include "core/stage/formats/artifacts.h"
#include "core/view/view_page.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

TEST_F(StageTest, ThePageIsMadeFromTheExportedSceneAndTheModel) {
  const Scene scene = RampScene(scratch_.path(), 48, 32);
  StageContext nothing = MakeContext();
  EXPECT_FALSE(WriteViewPage(scene, 1, nothing));
  GaussianModel model = SmallModel();
  model.confidence.assign(model.size(), 0.5f);
  AddInput(artifact::kModel, SerializeGaussians(model));
  AddInput(artifact::kPly, "the bytes of the exported file");
  StageContext context = MakeContext();
  EXPECT_EQ(WriteViewPage(scene, 1, context), HasViewer());
  if (!HasViewer()) {
    EXPECT_NE(observer_.text.find("npm"), std::string::npos) << observer_.text;
    return;
  }
  EXPECT_EQ(context.outputs(), (std::vector<std::string>{"view.html"}));
  const std::string html = ReadFile(scratch_.path() / "out/view.html");
  EXPECT_NE(html.find(Base64(Gzip("the bytes of the exported file"))), std::string::npos);
  // The smaller file is taken where there is one.
  AddInput(artifact::kSog, "the bytes of the smaller file");
  StageContext smaller = MakeContext();
  ASSERT_TRUE(WriteViewPage(scene, 1, smaller));
  EXPECT_NE(ReadFile(scratch_.path() / "out/view.html").find(Base64("the bytes of the smaller")),
            std::string::npos);
  for (const View& view : scene.views) {
    EXPECT_NE(html.find("\"name\":\"" + view.name), std::string::npos) << view.name;
  }
}

}  // namespace
}  // namespace color3d
