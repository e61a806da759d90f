#include "core/splat/import/splat_scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/error.h"
#include "core/splat/import/seen_gaussians.h"
#include "core/splat/raster/render.h"
#include "tests/support/quiet_run.h"
#include "tests/support/scenes/splat_files.h"

namespace color3d {
namespace {

constexpr int64_t kPlenty = int64_t{1} << 33;

SplatViewOptions Few() { return {.views = 8, .side_px = 160}; }

SplatScene Import(const std::string& ply, SplatViewOptions options = Few()) {
  QuietRun run(2);
  return ImportSplat(ply, "scene.ply", options, kPlenty, run.control());
}

TEST(SplatSceneTest, ViewsAreAboveGroundAndFaceBall) {
  const SplatScene splat = Import(SplatPly(BallOnGround(6000, 0.5f, 1)));
  const Scene& scene = splat.scene;
  ASSERT_EQ(scene.views.size(), 8u);
  EXPECT_EQ(scene.views[0].name, "view_01.png");
  EXPECT_TRUE(splat.had_color);
  EXPECT_THAT(splat.warnings, testing::ElementsAre(testing::HasSubstr("colours were removed")));
  QuietRun run(2);
  for (const View& view : scene.views) {
    const Eigen::Vector3d eye = view.cam_from_world.Center();
    EXPECT_LT(eye.y(), 1.0) << view.name << " is below the ground";
    EXPECT_GT(eye.norm(), 1.2) << view.name << " is inside of the ball";
    // Upright: the ground's normal points up in the picture.
    EXPECT_LT((view.cam_from_world.rotation * Eigen::Vector3d(0.0, -1.0, 0.0)).y(), 0.1);
    const Eigen::Vector3d ball = view.cam_from_world.Apply(Eigen::Vector3d::Zero());
    EXPECT_TRUE(ball.z() > 0.0 && view.camera.Contains(view.camera.Project(ball))) << view.name;
    const RenderedView shown =
        RenderView(splat.geometry, view.camera, view.cam_from_world, run.pool());
    double filled = 0.0;
    for (const float opacity : shown.opacity.data) filled += opacity;
    EXPECT_GT(filled / static_cast<double>(shown.opacity.data.size()), 0.25) << view.name;
  }
  // All are different.
  for (size_t i = 0; i < scene.views.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      EXPECT_GT(
          (scene.views[i].cam_from_world.Center() - scene.views[j].cam_from_world.Center()).norm(),
          0.2);
    }
  }
  EXPECT_GT(scene.points.size(), 500u);
  for (const SparsePoint& point : scene.points) EXPECT_GE(point.views.size(), 2u);
}

TEST(SplatSceneTest, UsesUpAxisGivenByUser) {
  ViewerGaussians g = BallOnGround(3000);  // turned: z is up
  for (size_t i = 0; i < g.size(); ++i) {
    float* p = g.position.data() + 3 * i;
    float* q = g.rotation.data() + 4 * i;
    std::swap(p[1], p[2]);
    p[2] = -p[2];
    // The quarter turn about x: (s, -s, 0, 0) * q without the factor.
    const float turned[4] = {q[0] + q[1], q[1] - q[0], q[2] + q[3], q[3] - q[2]};
    std::copy_n(turned, 4, q);
  }
  SplatViewOptions options = Few();
  options.up = SplatUp::kZ;
  for (const View& view : Import(SplatPly(g), options).scene.views) {
    EXPECT_GT(view.cam_from_world.Center().z(), -1.0);
    EXPECT_LT((view.cam_from_world.rotation * Eigen::Vector3d::UnitZ()).y(), 0.1) << view.name;
  }
}

TEST(SplatSceneTest, IsDeterministic) {
  const std::string ply = SplatPly(BallOnGround(500));
  EXPECT_EQ(SceneToJson(Import(ply).scene), SceneToJson(Import(ply).scene));
}

TEST(SplatSceneTest, ViewsWallFromMoreVisibleSide) {
  // A wall of small Gaussians in front of a curtain that hides them from behind.
  ViewerGaussians g = BallOnGround(2000);
  for (size_t i = 0; i < g.size(); ++i) {
    const bool curtain = i % 20 == 0;
    const double turn = 2.39996 * static_cast<double>(i);
    const double r = 2.0 * std::sqrt(static_cast<double>(i) / 2000.0);
    g.position[3 * i] = static_cast<float>(r * std::cos(turn));
    g.position[3 * i + 1] = static_cast<float>(r * std::sin(turn));
    g.position[3 * i + 2] = curtain ? 1.0f : 0.0f;
    const float size = curtain ? -0.3f : -3.0f;
    for (int k = 0; k < 3; ++k) g.log_scale[3 * i + k] = k == 2 ? -5.0f : size;
    for (int k = 0; k < 4; ++k) g.rotation[4 * i + k] = k == 0 ? 1.0f : 0.0f;
  }
  for (const View& view : Import(SplatPly(g)).scene.views) {
    EXPECT_LT(view.cam_from_world.Center().z(), 0.0) << view.name;
  }
}

TEST(SplatSceneTest, RecentersLargeCoordinatesWithNote) {
  const ViewerGaussians plain = BallOnGround(400);
  for (const auto& [scale, offset] :
       {std::pair(1e-3f, 0.0f), std::pair(1.0f, 4096.0f), std::pair(1e4f, 0.0f)}) {
    ViewerGaussians g = plain;
    for (float& x : g.position) x = scale * x + offset;
    for (float& s : g.log_scale) s += std::log(scale);
    const SplatScene splat = Import(SplatPly(g));
    for (size_t i = 0; i < 3 * g.size(); i += 3) {
      const Eigen::Vector3d at(splat.geometry.position[i],
                               splat.geometry.position[i + 1],
                               splat.geometry.position[i + 2]);
      EXPECT_LT(at.norm(), 300.0);
      const Eigen::Vector3d world = splat.scene.WorldFromScene(at);
      for (int k = 0; k < 3; ++k)
        EXPECT_NEAR(world[k], g.position[i + k], 1e-5 * scale + 1e-3 * (offset != 0.0f));
      EXPECT_NEAR(splat.geometry.log_scale[i] + std::log(splat.scene.world_from_scene_scale),
                  g.log_scale[i],
                  1e-4);
    }
  }
  EXPECT_EQ(Import(SplatPly(plain)).scene.world_from_scene_scale, 1.0);
}

TEST(SplatSceneTest, AcceptsOneGaussian) {
  const SplatScene one = Import(SplatPly(BallOnGround(1)));
  EXPECT_EQ(one.geometry.size(), 1u);
  EXPECT_GE(one.scene.views.size(), 2u);
}

TEST(SplatSceneTest, RejectsInvisibleModel) {
  ViewerGaussians g = BallOnGround(50);
  for (float& logit : g.opacity_logit) logit = -12.0f;
  try {
    Import(SplatPly(g));
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), testing::HasSubstr("cannot be seen from anywhere"));
  }
}

TEST(SplatSceneTest, NamesMemoryNeededIfTooLarge) {
  const std::string ply = SplatPly(BallOnGround(2000, 0.0f, 3));
  QuietRun run(1);
  const auto refusal = [&](int64_t memory) -> std::string {
    try {
      ImportSplat(ply, "scene.ply", Few(), memory, run.control());
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kResourceExhausted);
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(refusal(2000 * WorkBytesPerGaussian(3)), "");
  EXPECT_THAT(refusal(2000 * WorkBytesPerGaussian(3) - 1),
              testing::AllOf(testing::HasSubstr("2000 Gaussians"),
                             testing::HasSubstr("degree 3"),
                             testing::HasSubstr("enough for 1999")));
  EXPECT_THAT(refusal(1999 * WorkBytesPerGaussian(0)), testing::HasSubstr("at most 1999"));
}

}  // namespace
}  // namespace color3d
