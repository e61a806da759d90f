// Splats through the service: coloured without photos, or refused with a message of one line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "core/splat/export/sog/sog.h"
#include "core/splat/export/spz/spz.h"
#include "core/splat/import/splat_file.h"
#include "core/zip/zip.h"
#include "tests/integration/service_fixture.h"
#include "tests/support/scenes/splat_files.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class SplatSceneServiceTest : public ServiceTest {
 protected:
  void SetUp() override { StartServer(); }

  fs::path Write(const std::string& name, const std::string& bytes) {
    std::ofstream(Path(name), std::ios::binary) << bytes;
    return Path(name);
  }
  ProcessResult Colorize(const fs::path& splat, const std::vector<std::string>& more = {}) {
    return Client(std::vector<std::string>{"colorize",
                                           splat.string(),
                                           "-o",
                                           Path("out").string(),
                                           "--set",
                                           "import_scene.splat_views=6",
                                           "--set",
                                           "import_scene.splat_view_side_px=240"} +
                  QuickOptions() + more);
  }
};

TEST_F(SplatSceneServiceTest, ColorsAGraySplatInItsOwnFrame) {
  ViewerGaussians gray = BallOnGround(3000, 0.0f, 1);
  gray.position[3] = std::nanf("");
  const fs::path file = Write("bust.ply", SplatPly(gray));
  const ProcessResult result = Colorize(file, {"--auto"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("the splat bust.ply"));
  EXPECT_THAT(result.err, HasSubstr("1 of the 3000 Gaussians"));
  const ViewerGaussians colored = ReadSplat(ReadFile(Path("out") / "scene.ply"));
  ASSERT_EQ(colored.size(), 2999u);
  EXPECT_EQ(colored.sh_degree, 1);
  // The first one, and all after the dropped one.
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(colored.position[k], gray.position[k]);
    EXPECT_EQ(colored.position[3 + k], gray.position[6 + k]);
    EXPECT_EQ(colored.log_scale[k], gray.log_scale[k]);
  }
  for (const char* name : {"scene.sog", "report.html", "view.html", "key_view.png"}) {
    EXPECT_TRUE(fs::exists(Path("out") / name)) << name;
  }
  const auto plan = nlohmann::json::parse(ReadFile(Path("out") / "plan.json"));
  const auto geometry = std::find_if(plan.begin(), plan.end(), [](const auto& step) {
    return step.at("step") == "luminance_geometry";
  });
  ASSERT_NE(geometry, plan.end());
  EXPECT_FALSE(geometry->at("needed"));
  EXPECT_EQ(geometry->at("reason"), "the scene's Gaussians were given");
}

TEST_F(SplatSceneServiceTest, SelectsColorsAndAcceptsAKeyView) {
  ThreadPool pool(2);
  const fs::path file = Write("bust.spz", EncodeSpz(BallOnGround(1500), SpzVersion::k4, pool));
  const ProcessResult selected =
      Client({"--json", "key", "select", file.string(), "-o", Path("key").string()});
  ASSERT_EQ(selected.exit_code, 0) << selected.err;
  const std::string view = nlohmann::json::parse(selected.out).at("key_view");
  EXPECT_THAT(view, HasSubstr("view_"));
  EXPECT_TRUE(fs::exists(Path("key") / "key_view_ranking.jpg"));
  const ProcessResult colored =
      Client({"key", "color", file.string(), "--auto", "-o", Path("key").string()});
  ASSERT_EQ(colored.exit_code, 0) << colored.err;
  EXPECT_EQ(Client({"key", "accept", file.string()}).exit_code, 0);
  EXPECT_THAT(Client({"scene", "list"}).out, HasSubstr("splat"));
}

TEST_F(SplatSceneServiceTest, RefusesOtherFilesByName) {
  ThreadPool pool(1);
  ViewerGaussians nan = BallOnGround(20);
  for (float& logit : nan.opacity_logit) logit = std::nanf("");
  const std::string ply = SplatPly(BallOnGround(20));
  const std::string sog = EncodeSog(BallOnGround(20), pool);
  const struct {
    const char* name;
    std::string bytes;
    std::vector<std::string> words;
  } cases[] = {
      {"mesh.ply",
       "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\n"
       "property float y\nproperty float z\nelement face 0\n"
       "property list uchar int vertex_indices\nend_header\n0123456789ab",
       {"mesh.ply", "mesh"}},
      {"cut.ply", ply.substr(0, ply.size() / 2), {"cut.ply", "cut short"}},
      {"nan.ply", SplatPly(nan), {"nan.ply", "not a number"}},
      {"old.sog", StoredZip({{"meta.json", R"({"version":1})"}}), {"old.sog", "version 1"}},
      {"cut.sog", sog.substr(0, sog.size() - 30), {"cut.sog", "cut short"}},
      {"text.spz", "this is not a splat", {"text.spz", "not a readable splat"}},
  };
  for (const auto& bad : cases) {
    ExpectRefusal(Colorize(Write(bad.name, bad.bytes), {"--auto"}), 2, bad.words);
  }
  ExpectRefusal(Colorize(Write("photo.glb", "glTF"), {"--auto"}), 2, {"photo.glb", ".ply"});
  ExpectRefusal(Colorize(Write("good.ply", ply), {"--benchmark"}), 2, {"good.ply", "photos"});
}

}  // namespace
}  // namespace color3d
