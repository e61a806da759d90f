#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/base/text/base64.h"
#include "core/splat/export/motion/playable_scene.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
#include "core/view/view_page.h"
#include "core/zip/gzip.h"
#include "tests/support/formats/splat4d_reader.h"
#include "tests/support/formats/viewer_files.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

TEST_F(StageTest, ExportUsesWorldCoordinates) {
  Scene scene = RampScene(scratch_.path(), 48, 32);
  scene.world_from_scene_scale = 0.001;
  scene.world_offset = {1e6, 0.0, 0.0};
  AddInput(artifact::kScene, SceneToJson(scene));
  AddInput(artifact::kModel, SerializeGaussians(SmallModel()));
  StageContext context = MakeContext();
  RunExport({}, context);
  EXPECT_EQ(context.outputs(), (std::vector<std::string>{"scene.ply", "scene.sog", "export.json"}));
  EXPECT_NE(observer_.text.find("relative to the offset"), std::string::npos) << observer_.text;
  const std::string ply = ReadFile(scratch_.path() / "out/scene.ply");
  EXPECT_NE(ply.find("comment offset 1e+06 0 0\n"), std::string::npos);
  const ViewerGaussians from_ply = ReadPly(ply);
  const ViewerGaussians from_sog = ReadSog(ReadFile(scratch_.path() / "out/scene.sog"));
  ASSERT_EQ(from_ply.size(), 9u);
  ASSERT_EQ(from_sog.size(), 9u);
  for (int k = 0; k < 3; ++k) {  // one box, in the file's units
    const auto extent = [k](const ViewerGaussians& g) {
      float low = 1e30f, high = -1e30f;
      for (size_t i = k; i < g.position.size(); i += 3) {
        low = std::min(low, g.position[i]);
        high = std::max(high, g.position[i]);
      }
      return std::pair(low, high);
    };
    EXPECT_NEAR(extent(from_ply).first, extent(from_sog).first, 1e-7);
    EXPECT_NEAR(extent(from_ply).second, extent(from_sog).second, 1e-7);
  }
  const auto scores = nlohmann::json::parse(ReadFile(scratch_.path() / "out/export.json"));
  const double before = scores.at("ply").at("unrefined_psnr_db_vs_lab");
  const double after = scores.at("ply").at("psnr_db_vs_lab");
  EXPECT_GT(before, 20.0);
  EXPECT_GE(after, before);
  EXPECT_EQ(scores.at("ply").at("worst_view").get<std::string>().substr(0, 1), "p");
  StageContext again = MakeContext();
  EXPECT_THROW(RunExport({.formats = {}}, again), Error);
  EXPECT_THROW(RunExport({.formats = {ExportFormat::kSpz}, .spz_version = 3}, again), Error);
  RunExport({.formats = {ExportFormat::kSplat}}, again);
  EXPECT_EQ(again.outputs(), (std::vector<std::string>{"scene.splat", "export.json"}));
  EXPECT_EQ(ReadFile(scratch_.path() / "out/scene.splat").size(), 9u * 32);
  StageContext others = MakeContext();
  RunExport({.formats = {ExportFormat::kSpz, ExportFormat::kGlb}, .spz_version = 2}, others);
  EXPECT_EQ(others.outputs(), (std::vector<std::string>{"scene.spz", "scene.glb", "export.json"}));
  EXPECT_EQ(ReadSpz(ReadFile(scratch_.path() / "out/scene.spz")).size(), 9u);
  EXPECT_EQ(ReadGlb(ReadFile(scratch_.path() / "out/scene.glb")).position, from_ply.position);
}

// x of the ball, the Gaussian in front of the wall.
double BallX(const std::vector<double>& position) {
  return position[2] < position[5] ? position[0] : position[3];
}

class ExportDynamicTest : public StageTest {
 protected:
  void SetUp() override {
    Scene scene = RampScene(scratch_.path(), 48, 32);
    for (int i = 0; i < 3; ++i) scene.views[i].moment = Moment{static_cast<double>(i), 0};
    AddInput(artifact::kScene, SceneToJson(scene));
    AddInput(artifact::kKeyView, R"({"view": "p1.png"})");
    AddInput(artifact::kModel, SerializeGaussians(BallBeforeWall(0.0, 2.0)));
  }
};

TEST_F(ExportDynamicTest, WritesAPlyForEachTime) {
  StageContext context = MakeContext();
  RunExport({.formats = {ExportFormat::kPly, ExportFormat::kMoments}, .moments = 5}, context);
  for (int i = 0; i < 5; ++i) {
    const auto file = scratch_.path() / ("out/moments/0000" + std::to_string(i + 1) + ".ply");
    const ViewerGaussians at = ReadPly(ReadFile(file));
    ASSERT_EQ(at.size(), 2u);
    EXPECT_NEAR(BallX({at.position.begin(), at.position.end()}), -0.4 + 0.2 * i, 1e-5) << i;
  }
  EXPECT_EQ(std::count_if(context.outputs().begin(),
                          context.outputs().end(),
                          [](const std::string& name) { return name.starts_with("moments/"); }),
            5);
  // scene.ply has the time of the key view, the middle one; so does a single moment.
  const ViewerGaussians key = ReadPly(ReadFile(scratch_.path() / "out/scene.ply"));
  EXPECT_NEAR(BallX({key.position.begin(), key.position.end()}), 0.0, 1e-5);
  StageContext one = MakeContext();
  RunExport({.formats = {ExportFormat::kMoments}, .moments = 1}, one);
  EXPECT_EQ(one.outputs(), (std::vector<std::string>{"moments/00001.ply", "export.json"}));
  const ViewerGaussians middle = ReadPly(ReadFile(scratch_.path() / "out/moments/00001.ply"));
  EXPECT_NEAR(BallX({middle.position.begin(), middle.position.end()}), 0.0, 1e-5);
}

TEST_F(ExportDynamicTest, PagePlaysAllTimes) {
  if (!HasViewer())
    GTEST_SKIP() << "skipped, because the viewer was left out of this build (no npm)";
  StageContext context = MakeContext();
  RunExport({.formats = {ExportFormat::kSog}}, context);
  const std::string html = ReadFile(scratch_.path() / "out/view.html");
  const auto between = [&](const std::string& begin) {
    const size_t at = html.find(begin) + begin.size();
    return html.substr(at, html.find("</script>", at) - at);
  };
  const auto facts = nlohmann::json::parse(between("id=\"facts\">")).at("motion");
  EXPECT_EQ(facts.at("shown"), 1.0);
  EXPECT_EQ(facts.at("steps"), 3);
  EXPECT_EQ(facts.at("film").size(), 3u);  // the camera moves
  EXPECT_EQ(facts.at("film").at(2).at("time"), 2.0);
  const GaussianModel seen = EverSeen(BallBeforeWall(0.0, 2.0));
  const std::string motion =
      EncodePlayable(seen, FitRgbHarmonics(seen, context.pool()), {}, context.pool()).motion;
  EXPECT_EQ(between("id=\"motion\">"), Base64(Gzip(motion)));
  const auto scores = nlohmann::json::parse(ReadFile(scratch_.path() / "out/export.json"));
  EXPECT_GT(scores.at("page").at("psnr_db_vs_lab"), 30.0);
}

TEST_F(ExportDynamicTest, Splat4dHasAFrameForEachTime) {
  StageContext context = MakeContext();
  RunExport({.formats = {ExportFormat::kSplat4d}}, context);
  const Splat4dFile file = ReadSplat4d(ReadFile(scratch_.path() / "out/scene.splat4d"));
  ASSERT_EQ(file.frames.size(), 3u);
  EXPECT_EQ(file.moving, 1u);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(BallX(file.frames[i].position), -0.4 + 0.4 * i, 2.0 * file.position_bound) << i;
  }
  StageContext without = MakeContext();
  RunExport({.formats = {ExportFormat::kPly}}, without);
  EXPECT_EQ(std::count(without.outputs().begin(), without.outputs().end(), "scene.splat4d"), 0);
}

TEST_F(ExportDynamicTest, WritesEveryFormatAlone) {
  for (const ExportFormatInfo& info : kExportFormats) {
    SCOPED_TRACE(info.option);
    std::filesystem::remove_all(scratch_.path() / "out");
    StageContext context = MakeContext();
    const int moments = info.format == ExportFormat::kMoments ? 2 : 0;
    RunExport({.formats = {info.format}, .moments = moments}, context);
    EXPECT_TRUE(std::filesystem::exists(scratch_.path() / "out" / info.artifact));
  }
}

TEST_F(ExportDynamicTest, WarnsWhenTheOnlyFormatNeedsMotion) {
  AddInput(artifact::kModel, SerializeGaussians(SmallModel()));
  StageContext context = MakeContext();
  RunExport({.formats = {ExportFormat::kSplat4d}}, context);
  EXPECT_NE(observer_.text.find("scene.splat4d is not written"), std::string::npos);
}

TEST_F(ExportDynamicTest, WritesNoMomentsOfAStaticScene) {
  AddInput(artifact::kModel, SerializeGaussians(SmallModel()));
  StageContext context = MakeContext();
  RunExport({.formats = {ExportFormat::kPly, ExportFormat::kMoments}, .moments = 3}, context);
  EXPECT_NE(observer_.text.find("nothing moves in this scene: moments/ is not written"),
            std::string::npos);
  for (const std::string& name : context.outputs()) {
    EXPECT_FALSE(name.starts_with("moments/") || name == "scene.splat4d") << name;
  }
}

}  // namespace
}  // namespace color3d
