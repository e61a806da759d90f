// Files for viewers, read by npm's splat-transform if it is installed.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/process/subprocess.h"
#include "core/splat/export/export.h"
#include "core/splat/export/sog/sog.h"
#include "core/splat/export/spz/spz.h"
#include "tests/support/formats/viewer_files.h"
#include "tests/support/scenes/random_model.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;

constexpr char kHowToInstall[] =
    "splat-transform is not installed, so exported files were not checked with it: npm install "
    "--prefix " COLOR3D_NPM_FOLDER " @playcanvas/splat-transform, or COLOR3D_SPLAT_TRANSFORM=PATH";

// Name or path of the tool.
std::string SplatTransform() {
  if (const char* given = std::getenv("COLOR3D_SPLAT_TRANSFORM")) return given;
  const fs::path local = fs::path(COLOR3D_NPM_FOLDER) / "node_modules/.bin/splat-transform";
  return fs::exists(local) ? local.string() : "splat-transform";
}

class ViewerToolsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    try {
      const SubprocessResult result =
          RunSubprocess({.arguments = {SplatTransform(), "--version"}}, {});
      if (result.exit_code == 0) return;
    } catch (const Error& e) {
      if (e.code() != ErrorCode::kFailedPrecondition) throw;
    }
    GTEST_SKIP() << kHowToInstall;
  }

  // Converts `bytes` to PLY with the tool.
  ViewerGaussians Converted(const std::string& name, const std::string& bytes) {
    const fs::path from = scratch_.path() / name, to = scratch_.path() / (name + ".ply");
    const fs::path log = scratch_.path() / "log";
    WriteFileAtomic(from, bytes);
    const SubprocessResult result = RunSubprocess(
        {.arguments = {SplatTransform(), "-w", from.string(), to.string()}, .log_path = log}, {});
    EXPECT_EQ(result.exit_code, 0) << ReadFile(log);
    return result.exit_code == 0 ? ReadPly(ReadFile(to)) : ViewerGaussians();
  }

  ScratchFolder scratch_;
};

// Gaussians in front of a camera, similar to those of a scene.
GaussianModel Cloud(int degree) {
  GaussianModel model = RandomModel({3000, 3, degree, 0, /*chroma_size=*/0.03});
  const int coefficients = (degree + 1) * (degree + 1);
  for (size_t i = 0; i < model.size(); ++i) {
    model.position[3 * i + 2] += 6.0f;
    for (size_t k = 3 * i; k < 3 * i + 3; ++k)
      model.log_scale[k] = 0.3f * model.log_scale[k] - 2.5f;
    for (int k = 1; k < coefficients; ++k) model.sh_l[coefficients * i + k] *= 0.2f;
  }
  return model;
}

TEST_F(ViewerToolsTest, SplatTransformReadsOurFilesAlike) {
  ThreadPool pool(2);
  const ExportFrame frame{2.0, {1.0, -3.0, 0.5}, {0.0, 0.0, 0.0}};
  const Camera camera{160, 120, 150.0, 150.0, 80.0, 60.0};
  Pose pose;
  pose.translation = -frame.offset;
  for (const int degree : {0, 2, 3}) {
    const GaussianModel model = Cloud(degree);
    const RgbHarmonics rgb = FitRgbHarmonics(model, pool);
    const ViewerGaussians g = ForViewers(model, rgb, frame, pool);
    const Image truth = RenderForViewers(g, camera, pose, pool);
    const auto check = [&](const std::string& name,
                           const std::string& bytes,
                           ViewerGaussians (*ours)(std::string_view, const SplatSource&),
                           double least_db) {
      SCOPED_TRACE(fmt::format("{} of degree {}", name, degree));
      const ViewerGaussians file = Converted(name, bytes);
      ASSERT_EQ(file.size(), g.size());
      ASSERT_EQ(file.sh_degree, degree);
      const double theirs_db = PsnrOf(truth, RenderForViewers(file, camera, pose, pool));
      const double ours_db = PsnrOf(truth, RenderForViewers(ours(bytes, {}), camera, pose, pool));
      std::printf("%s of degree %d: %.2f dB by splat-transform, %.2f dB by our reader\n",
                  name.c_str(),
                  degree,
                  theirs_db,
                  ours_db);
      EXPECT_GE(theirs_db, least_db);
      EXPECT_NEAR(theirs_db, ours_db, 0.5);
    };
    check("scene.sog", EncodeSog(g, pool), ReadSog, 30.0);
    check("scene.spz", EncodeSpz(g, SpzVersion::k4, pool), ReadSpz, 30.0);
    check("version2.spz", EncodeSpz(g, SpzVersion::k2, pool), ReadSpz, 30.0);
  }
}

TEST_F(ViewerToolsTest, SplatTransformReadsOneGaussian) {
  ThreadPool pool(1);
  const GaussianModel model = RandomModel({1, 3, 1, 0, 0.03});
  const ViewerGaussians g = ForViewers(model, FitRgbHarmonics(model, pool), {}, pool);
  EXPECT_EQ(Converted("one.sog", EncodeSog(g, pool)).size(), 1u);
  EXPECT_EQ(Converted("one.spz", EncodeSpz(g, SpzVersion::k4, pool)).size(), 1u);
}

}  // namespace
}  // namespace color3d
