#include "tests/support/scenes/dynamic_scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/random.h"
#include "core/color/difference.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/scene/import/import.h"
#include "tests/support/quiet_run.h"

namespace color3d {
namespace {

DynamicSceneOptions Small(DynamicCase which) {
  DynamicSceneOptions options;
  options.which = which;
  options.cameras = 3;
  options.sparse_points = 200;
  return options;
}

LabColor ColorAt(const Image& lab, const Eigen::Vector2d& pixel) {
  const int x = static_cast<int>(pixel.x()), y = static_cast<int>(pixel.y());
  return {lab.At(0, y, x), lab.At(1, y, x), lab.At(2, y, x)};
}

double Median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

// Colour differences of pairs of pixels of the same point, and of pixels at mirrored positions.
struct Differences {
  std::vector<double> same, other;
  void Add(const Image& a, const Eigen::Vector2d& pa, const Image& b, const Eigen::Vector2d& pb) {
    same.push_back(DeltaE00(ColorAt(a, pa), ColorAt(b, pb)));
    other.push_back(DeltaE00(ColorAt(a, pa), ColorAt(b, {b.width - 1 - pb.x(), pb.y()})));
  }
};

class DynamicCasesTest : public testing::TestWithParam<DynamicCase> {};

TEST_P(DynamicCasesTest, BackgroundPointsKeepTheirColor) {
  const DynamicScene made(Small(GetParam()));
  const Scene& scene = made.scene();
  ASSERT_EQ(scene.points.size(), 200u);
  Differences differences;
  const int last = made.times() - 1;
  const int pairs[][2] = {{made.ViewOf(1, 0), made.ViewOf(1, last)},
                          {made.ViewOf(0, last), made.ViewOf(1, 0)},
                          {made.ViewOf(1, last / 2), made.ViewOf(2, last)}};
  for (const auto& [first, second] : pairs) {
    const Image a = LabFromSrgb(made.RenderSrgb(first)), b = LabFromSrgb(made.RenderSrgb(second));
    for (const SparsePoint& point : scene.points) {
      const auto sees = [&](int v) {
        return std::binary_search(point.views.begin(), point.views.end(), v);
      };
      if (!sees(first) || !sees(second)) continue;
      differences.Add(a,
                      *PixelOf(scene.views[first], point.position),
                      b,
                      *PixelOf(scene.views[second], point.position));
    }
  }
  ASSERT_GT(differences.same.size(), 200u);
  EXPECT_LT(Median(differences.same), 4.0);
  EXPECT_GT(Median(differences.other), 3.0 * Median(differences.same));
}

TEST_P(DynamicCasesTest, PointsLieOnTheBackground) {
  const DynamicScene made(Small(GetParam()));
  for (const SparsePoint& point : made.scene().points) {
    std::set<int> cameras;
    for (size_t v = 0; v < made.scene().views.size(); ++v) {
      const bool listed =
          std::binary_search(point.views.begin(), point.views.end(), static_cast<int>(v));
      ASSERT_EQ(listed, made.Shows(static_cast<int>(v), point.position));
      if (!listed) continue;
      const View& view = made.scene().views[v];
      const auto pixel = *PixelOf(view, point.position);
      const SeenPoint seen = made.Look(static_cast<int>(v), pixel.x(), pixel.y());
      EXPECT_EQ(seen.mover, -1);
      EXPECT_LT((seen.position - point.position).norm(), 1e-3);
      cameras.insert(view.moment->shot);
    }
    EXPECT_EQ(cameras.size(), 3u);
  }
}

TEST_P(DynamicCasesTest, MovingPointsKeepTheirColor) {
  const DynamicScene made(Small(GetParam()));
  Differences differences;
  double farthest = 0.0;
  Random random(3);
  const int first_time = made.times() / 2;
  const int from = made.ViewOf(1, first_time);
  const Image a = LabFromSrgb(made.RenderSrgb(from));
  for (int time = std::max(0, first_time - 1); time < std::min(made.times(), first_time + 2);
       ++time) {
    const int to = made.ViewOf(1, time);
    const Image b = LabFromSrgb(made.RenderSrgb(to));
    for (int i = 0; i < 4000 && time != first_time; ++i) {
      const Eigen::Vector2d pixel(random.NextUniform(0.0, 128.0), random.NextUniform(0.0, 96.0));
      const SeenPoint seen = made.Look(from, pixel.x(), pixel.y());
      if (seen.mover < 0) continue;
      EXPECT_LT((*made.Follow(seen, first_time) - seen.position).norm(), 1e-9);
      const auto later = made.Follow(seen, time);
      if (!later || !made.Shows(to, *later)) continue;
      farthest = std::max(farthest, (*later - seen.position).norm());
      differences.Add(a, pixel, b, *PixelOf(made.scene().views[to], *later));
    }
  }
  if (!IsMoving(GetParam())) {
    EXPECT_TRUE(differences.same.empty());
    return;
  }
  ASSERT_GT(differences.same.size(), 50u);
  EXPECT_LT(Median(differences.same), 5.0);
  EXPECT_GT(Median(differences.other), 3.0 * Median(differences.same));
  if (GetParam() == DynamicCase::kAppearing) {
    EXPECT_LT(farthest, 1e-12);
  } else {
    EXPECT_GT(farthest, 0.03);
  }
}

// With static cameras, a pixel without mover never changes, and one with a mover mostly differs
// from the room.
TEST_P(DynamicCasesTest, MasksHoldAllChanges) {
  const DynamicScene made(Small(GetParam()));
  double share = 0.0;
  int unlike = 0, masked = 0;
  const size_t plane = 128 * 96;
  std::vector<float> still(3 * plane, -1.0f);
  for (int pass = 0; pass < 2; ++pass) {
    for (int t = 0; t < made.times(); ++t) {
      const int view = made.ViewOf(1, t);
      const Image picture = made.RenderSrgb(view), mask = made.RenderMovers(view);
      for (size_t i = 0; i < plane; ++i) {
        ASSERT_GE(mask.data[i], 0.0f);
        ASSERT_LE(mask.data[i], 1.0f);
        share += mask.data[i] / static_cast<double>(plane * made.times() * 2);
        for (int c = 0; c < 3; ++c) {
          float& known = still[c * plane + i];
          const float value = picture.Plane(c)[i];
          if (mask.data[i] == 0.0f) {
            if (known < 0.0f) known = value;
            ASSERT_EQ(value, known) << "pixel " << i << " at " << t;
          } else if (pass == 1 && known >= 0.0f && mask.data[i] == 1.0f) {
            ++masked;
            unlike += std::abs(value - known) > 0.02f;
          }
        }
      }
    }
  }
  if (!IsMoving(GetParam())) {
    EXPECT_EQ(share, 0.0);
    return;
  }
  EXPECT_GT(share, 0.005);
  EXPECT_LT(share, 0.2);
  if (masked > 0) {
    EXPECT_GT(unlike, 0.7 * masked);
  }
}

TEST_P(DynamicCasesTest, MasksAndDepthAgreeWithThePicture) {
  DynamicSceneOptions options = Small(GetParam());
  options.supersampling = 3;  // the middle sample is the pixel's centre
  const DynamicScene made(options);
  const int view = made.ViewOf(2, made.times() / 2);
  const Image mask = made.RenderMovers(view), depth = made.RenderDepth(view);
  for (int y = 0; y < 96; ++y) {
    for (int x = 0; x < 128; ++x) {
      const SeenPoint seen = made.Look(view, x + 0.5, y + 0.5);
      EXPECT_NEAR(depth.At(0, y, x), seen.depth, 1e-6 * seen.depth);
      EXPECT_NEAR(
          made.scene().views[view].cam_from_world.Apply(seen.position).z(), seen.depth, 1e-9);
      if (mask.At(0, y, x) == 1.0f) {
        EXPECT_GE(seen.mover, 0);
      } else if (mask.At(0, y, x) == 0.0f) {
        EXPECT_EQ(seen.mover, -1);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(DynamicScene,
                         DynamicCasesTest,
                         testing::ValuesIn(DynamicCases()),
                         [](const auto& info) { return DynamicCaseName(info.param); });

// Share of moving pixels in the middle camera at each time.
std::vector<double> MovingShares(DynamicCase which) {
  const DynamicScene made(Small(which));
  std::vector<double> shares;
  for (int t = 0; t < made.times(); ++t) {
    double sum = 0.0;
    for (float v : made.RenderMovers(made.ViewOf(1, t)).data) sum += v;
    shares.push_back(sum / (128.0 * 96.0));
  }
  return shares;
}

TEST(DynamicScene, ObjectsAppearVanishAndCrossOnTime) {
  const std::vector<double> appearing = MovingShares(DynamicCase::kAppearing);
  ASSERT_EQ(appearing.size(), 12u);
  for (int t = 0; t < 12; ++t) {
    EXPECT_EQ(appearing[t], appearing[t < 4 ? 0 : t < 8 ? 4 : 8]);
  }
  EXPECT_NEAR(appearing[4], appearing[0] + appearing[8], 1e-9);
  EXPECT_GT(appearing[0], 0.01);
  EXPECT_GT(appearing[8], 0.01);
  const std::vector<double> fast = MovingShares(DynamicCase::kFast);
  for (int t = 0; t < 12; ++t) EXPECT_EQ(fast[t] > 0.0, t >= 5 && t <= 7) << t;
  for (double share : MovingShares(DynamicCase::kTurning)) EXPECT_GT(share, 0.03);
}

TEST(DynamicScene, ScenesEqualImportedOnes) {
  DynamicSceneOptions options = Small(DynamicCase::kSliding);
  EXPECT_TRUE(DynamicScene(options).scene().capture().is_dynamic);
  EXPECT_EQ(DynamicScene(options).scene().views.size(), 36u);
  const Scene scene = DynamicScene(options).scene();
  EXPECT_TRUE(std::is_sorted(
      scene.views.begin(), scene.views.end(), [](auto& a, auto& b) { return a.name < b.name; }));
  EXPECT_EQ(scene.views[13].name, "cam01/0001.png");
  EXPECT_EQ(scene.views[13].moment, (Moment{0.125, 1}));
  options.cameras = 1;
  EXPECT_FALSE(DynamicScene(options).scene().capture().is_reconstructed);
  options.moving_cameras = true;
  const DynamicScene film(options);
  EXPECT_TRUE(film.scene().capture().is_dynamic);
  ASSERT_EQ(film.scene().points.size(), 200u);
  for (const SparsePoint& point : film.scene().points) {
    EXPECT_GE(point.views.size(), 3u);
    for (int v : point.views) EXPECT_TRUE(film.Shows(v, point.position));
  }
  EXPECT_EQ(DynamicScene(Small(DynamicCase::kOneStep)).times(), 1);
  EXPECT_EQ(DynamicScene(Small(DynamicCase::kStill)).times(), 8);
}

TEST(DynamicScene, WrittenScenesAreReadBack) {
  const ScratchFolder folder;
  QuietRun run;
  DynamicSceneOptions options = Small(DynamicCase::kTurning);
  options.times = 3;
  options.moving_cameras = true;
  const DynamicScene made(options);
  WriteDynamicScene(folder.path() / "in", made);
  const Scene read =
      ImportScene(folder.path() / "in", folder.path() / "scratch", {}, run.control()).scene;
  ASSERT_EQ(read.views.size(), 9u);
  for (int v = 0; v < 9; ++v) {
    const View& expected = made.scene().views[v];
    EXPECT_EQ(read.views[v].name, expected.name);
    EXPECT_LT((read.WorldFromScene(read.views[v].cam_from_world.Center()) -
               expected.cam_from_world.Center())
                  .norm(),
              1e-9);
    EXPECT_EQ(read.views[v].moment, expected.moment);
    EXPECT_NEAR(read.views[v].camera.fx, expected.camera.fx, 1e-9);
    const Image picture = ReadImage(folder.path() / "in" / expected.image_file);
    const Image truth = made.RenderSrgb(v);
    ASSERT_EQ(picture.data.size(), truth.data.size());
    for (size_t i = 0; i < truth.data.size(); ++i) {
      ASSERT_NEAR(picture.data[i], truth.data[i], 0.51 / 255.0);
    }
  }
  const std::string json = ReadFile(folder.path() / "in/transforms.json");
  EXPECT_THAT(json, testing::HasSubstr("\"time\": 0.25"));
  EXPECT_THAT(json, testing::HasSubstr("\"camera\": \"cam02\""));
}

TEST(DynamicScene, SameSeedSamePixelsOnAnyNumberOfThreads) {
  DynamicSceneOptions options = Small(DynamicCase::kTurning);
  for (const bool moving : {false, true}) {
    options.moving_cameras = moving;
    options.seed = 1;
    options.threads = 1;
    const DynamicScene first(options);
    options.threads = 3;
    const DynamicScene again(options);
    EXPECT_EQ(first.RenderSrgb(5).data, again.RenderSrgb(5).data);
    EXPECT_EQ(SceneToJson(first.scene()), SceneToJson(again.scene()));
    options.seed = 2;
    EXPECT_NE(DynamicScene(options).RenderSrgb(5).data, first.RenderSrgb(5).data);
  }
}

TEST(DynamicScene, RefusesBadOptions) {
  const auto refused = [](auto change) {
    DynamicSceneOptions options;
    change(options);
    EXPECT_THROW(DynamicScene{options}, Error);
  };
  refused([](DynamicSceneOptions& o) { o.cameras = 0; });
  refused([](DynamicSceneOptions& o) { o.times = -1; });
  refused([](DynamicSceneOptions& o) { o.width = 4000; });
  refused([](DynamicSceneOptions& o) { o.which = DynamicCase::kOneStep, o.times = 2; });
  for (const DynamicCase each : DynamicCases()) {
    EXPECT_EQ(DynamicCaseFromName(DynamicCaseName(each)), each);
  }
  EXPECT_THROW(DynamicCaseFromName("flying"), Error);
}

}  // namespace
}  // namespace color3d
