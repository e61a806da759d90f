#include "core/carry/carry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/carry/fusion.h"
#include "core/carry/plane_sweep.h"
#include "core/carry/stereo_views.h"
#include "core/image/codec.h"

namespace color3d {
namespace {

using testing::HasSubstr;

constexpr int kWidth = 160, kHeight = 120;
constexpr double kFocal = 150.0;
constexpr double kWallDepth = 4.0;

// A fixed picture on the plane z = kWallDepth: smooth, with detail down to a few pixels.
double WallLuminance(double x, double y) {
  return 50.0 + 14.0 * std::sin(5.0 * x + 1.3 * y) + 12.0 * std::sin(11.0 * y - 3.0 * x) +
         8.0 * std::sin(23.0 * x) * std::cos(19.0 * y);
}
double WallA(double x, double y) { return 30.0 * std::sin(1.5 * x) + 10.0 * std::cos(2.0 * y); }

struct Seen {
  SurfaceView surface;
  Image ab;
};

// A camera at (x, y, 0) that looks along +z at the wall, with an optional square of side `size`
// at half the depth around the axis.
Seen Look(double x, double y, double occluder = 0.0) {
  Seen out;
  out.surface.camera = {kWidth, kHeight, kFocal, kFocal, kWidth / 2.0, kHeight / 2.0};
  out.surface.cam_from_world.translation = Eigen::Vector3d(-x, -y, 0);
  out.surface.luminance = Image(kWidth, kHeight, 1);
  out.surface.depth = Image(kWidth, kHeight, 1);
  out.ab = Image(kWidth, kHeight, 2);
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 0; column < kWidth; ++column) {
      const double rx = (column + 0.5 - kWidth / 2.0) / kFocal;
      const double ry = (row + 0.5 - kHeight / 2.0) / kFocal;
      double depth = kWallDepth / 2;
      const bool hit = std::abs(x + rx * depth) < occluder && std::abs(y + ry * depth) < occluder;
      if (!hit) depth = kWallDepth;
      const double wx = x + rx * depth, wy = y + ry * depth;
      out.surface.depth.At(0, row, column) = static_cast<float>(depth);
      out.surface.luminance.At(0, row, column) = static_cast<float>(
          hit ? 30.0 + 0.6 * WallLuminance(3.0 * wx + 0.7, 2.5 * wy - 0.4) : WallLuminance(wx, wy));
      out.ab.At(0, row, column) = static_cast<float>(hit ? -60.0 : WallA(wx, wy));
      out.ab.At(1, row, column) = hit ? -60.0f : 12.0f;
    }
  }
  return out;
}

TEST(CarryTest, CarriesColorsOfPlaneByGeometry) {
  const Seen source = Look(0.0, 0.0), target = Look(0.5, -0.2);
  const CarriedColor carried =
      CarryColor(source.surface, source.ab, {}, target.surface, CarryOptions{});
  int sure = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (carried.confidence.At(0, y, x) < 0.8f) continue;
      ++sure;
      ASSERT_NEAR(carried.ab.At(0, y, x), target.ab.At(0, y, x), 1.5) << x << " " << y;
      ASSERT_NEAR(carried.ab.At(1, y, x), 12.0, 0.1);
    }
  }
  // 19 of 160 columns and 8 of 120 rows leave the source picture.
  EXPECT_GT(sure, 0.75 * kWidth * kHeight);
  for (int y = 0; y < kHeight; ++y) EXPECT_EQ(carried.confidence.At(0, y, kWidth - 2), 0.0f);
}

TEST(CarryTest, SkipsOccludedPixels) {
  // The square hides a part of the wall from the source that the target sees.
  const Seen source = Look(0.0, 0.0, 0.25), target = Look(0.6, 0.0, 0.25);
  const CarriedColor carried =
      CarryColor(source.surface, source.ab, {}, target.surface, CarryOptions{});
  int wrong = 0, hidden = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double depth = target.surface.depth.At(0, y, x);
      const double wx = 0.6 + depth * (x + 0.5 - kWidth / 2.0) / kFocal;
      const double wy = depth * (y + 0.5 - kHeight / 2.0) / kFocal;
      // Whether the square hides this place of the wall from the source at the origin.
      const bool is_hidden = depth == kWallDepth && std::abs(wx) < 0.47 && std::abs(wy) < 0.47;
      hidden += is_hidden;
      wrong += is_hidden && carried.confidence.At(0, y, x) > 0.25f;
    }
  }
  ASSERT_GT(hidden, 300);
  EXPECT_LT(wrong, hidden / 50);
}

TEST(CarryTest, DistrustsOtherLuminance) {
  const Seen source = Look(0.0, 0.0);
  Seen target = Look(0.2, 0.0);
  Random random(3);
  for (float& value : target.surface.luminance.data) {
    value = 100.0f * static_cast<float>(random.NextUniform());
  }
  const CarriedColor carried =
      CarryColor(source.surface, source.ab, {}, target.surface, CarryOptions{});
  EXPECT_LT(Coverage(carried, 0.25f), 0.1);
}

TEST(CarryTest, AcceptsDarkerExposure) {
  const Seen source = Look(0.0, 0.0);
  Seen target = Look(0.2, 0.0);
  for (float& value : target.surface.luminance.data) value = 0.85f * value;
  const CarriedColor carried =
      CarryColor(source.surface, source.ab, {}, target.surface, CarryOptions{});
  EXPECT_GT(Coverage(carried, 0.25f), 0.7);
}

TEST(CarryTest, CarriesNothingWithoutGeometry) {
  Seen source = Look(0.0, 0.0), target = Look(0.1, 0.0);
  target.surface.depth = Image(kWidth, kHeight, 1);
  const CarriedColor carried =
      CarryColor(source.surface, source.ab, {}, target.surface, CarryOptions{});
  EXPECT_EQ(Coverage(carried, 0.0f), 0.0);
  for (float value : carried.ab.data) EXPECT_EQ(value, 0.0f);
}

TEST(CarryTest, RefusesPicturesOfOtherSize) {
  Seen source = Look(0.0, 0.0);
  Seen target = source;
  target.surface.depth = Image(3, 3, 1);
  try {
    CarryColor(source.surface, source.ab, {}, target.surface, CarryOptions{});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    EXPECT_THAT(error.what(), HasSubstr("3x3"));
  }
}

TEST(CarryTest, SecondSourceFillsWithoutAveraging) {
  CarriedColor first{Image(2, 1, 2), Image(2, 1, 1)};
  CarriedColor second = first;
  first.ab.data = {50, 0, 50, 0};
  first.confidence.data = {1.0f, 0.0f};
  second.ab.data = {-50, -50, -50, -50};
  second.confidence.data = {1.0f, 0.5f};
  FillFrom(second, &first);
  EXPECT_EQ(first.ab.At(0, 0, 0), 50.0f);
  EXPECT_EQ(first.ab.At(0, 0, 1), -50.0f);
  EXPECT_EQ(first.confidence.data[0], 1.0f);
  EXPECT_EQ(first.confidence.data[1], 0.5f);
}

// Personalization refuses confidences above 1.
TEST(CarryTest, KeepsConfidencesWithinOne) {
  Random random(3);
  for (int trial = 0; trial < 200; ++trial) {
    const int width = 1 + static_cast<int>(random.NextUniform(0, 60));
    const int height = 1 + static_cast<int>(random.NextUniform(0, 60));
    CarriedColor all{Image(width, height, 2), Image(width, height, 1)};
    for (int key = 0; key < 1 + trial % 5; ++key) {
      CarriedColor one = all;
      for (float& value : one.confidence.data) {
        const double draw = random.NextUniform(0.0, 1.0);
        value = draw < 0.2 ? 1.0f : static_cast<float>(draw);
      }
      // Confidences of key views are resized.
      one.confidence = Resize(one.confidence, 3 * width / 2 + 1, height);
      one.confidence = Resize(one.confidence, width, height);
      FillFrom(one, &all);
    }
    const Image small = FitWithin(all.confidence, 1 + static_cast<int>(random.NextUniform(0, 60)));
    for (const Image* map : {&std::as_const(all.confidence), &small}) {
      for (const float value : map->data) {
        ASSERT_GE(value, 0.0f) << trial;
        ASSERT_LE(value, 1.0f) << trial;
      }
    }
  }
}

TEST(PlaneSweepTest, FindsDepthOfWallAndForeground) {
  const Seen reference = Look(0.0, 0.0, 0.25), left = Look(-0.3, 0.0, 0.25),
             right = Look(0.3, 0.1, 0.25);
  const auto posed = [](const Seen& seen) {
    return PosedLuminance{
        seen.surface.camera, seen.surface.cam_from_world, &seen.surface.luminance};
  };
  const Image depth =
      SweepPlanes(posed(reference), {posed(left), posed(right)}, 1.2, 8.0, PlaneSweepOptions{}, {});
  int wall = 0, right_wall = 0, square = 0, right_square = 0;
  for (int y = 10; y < kHeight - 10; ++y) {
    for (int x = 20; x < kWidth - 20; ++x) {
      const double truth = reference.surface.depth.At(0, y, x);
      const bool close = std::abs(depth.At(0, y, x) - truth) < 0.04 * truth;
      (truth == kWallDepth ? wall : square) += 1;
      (truth == kWallDepth ? right_wall : right_square) += close;
    }
  }
  EXPECT_GT(right_wall, 0.9 * wall);
  EXPECT_GT(right_square, 0.8 * square);
}

// In each photo another object occludes the same part of the wall.
TEST(PlaneSweepTest, DoesNotMatchMaskedPixels) {
  Seen seen[3] = {Look(0.0, 0.0), Look(-0.3, 0.0), Look(0.3, 0.1)};
  Image mask(kWidth, kHeight, 1, 1.0f);
  Random random(4);
  for (int i = 0; i < 3; ++i) {
    Image picture(kWidth, kHeight, 1);
    for (float& value : picture.data) value = static_cast<float>(random.NextUniform(0.0, 100.0));
    for (int y = 45; y < 75; ++y) {
      for (int x = 60; x < 100; ++x) {
        seen[i].surface.luminance.At(0, y, x) = picture.At(0, y, x);
        mask.At(0, y, x) = 0.0f;
      }
    }
  }
  const auto right = [&](const Image* of_reference, const Image* of_sources) {
    const auto posed = [&](int i) {
      const SurfaceView& surface = seen[i].surface;
      return PosedLuminance{surface.camera,
                            surface.cam_from_world,
                            &surface.luminance,
                            i == 0 ? of_reference : of_sources};
    };
    const Image depth =
        SweepPlanes(posed(0), {posed(1), posed(2)}, 1.2, 8.0, PlaneSweepOptions{}, {});
    int close = 0;
    for (int y = 45; y < 75; ++y) {
      for (int x = 60; x < 100; ++x) {
        close += std::abs(depth.At(0, y, x) - kWallDepth) < 0.05 * kWallDepth;
      }
    }
    return close / (30.0 * 40.0);
  };
  const double plain = right(nullptr, nullptr), masked = right(&mask, &mask);
  EXPECT_LT(plain, 0.8);
  EXPECT_GT(masked, 0.95) << "depth from unmasked neighbours";
  const Image whole(kWidth, kHeight, 1, 1.0f);
  EXPECT_EQ(right(&whole, &whole), plain) << "a mask without zeros has no effect";
}

TEST(PlaneSweepTest, RefusesEmptyRangesAndNoSources) {
  const Seen seen = Look(0.0, 0.0);
  const PosedLuminance view{
      seen.surface.camera, seen.surface.cam_from_world, &seen.surface.luminance};
  EXPECT_THROW(SweepPlanes(view, {}, 1, 2, PlaneSweepOptions{}, {}), Error);
  EXPECT_THROW(SweepPlanes(view, {view}, 2, 2, PlaneSweepOptions{}, {}), Error);
  EXPECT_THROW(SweepPlanes(view, {view}, 0, 2, PlaneSweepOptions{}, {}), Error);
  EXPECT_THROW(SweepPlanes(view, {view}, 1, 2, PlaneSweepOptions{.planes = 4}, {}), Error);
}

TEST(PlaneSweepTest, GivesFiniteDepthsWithoutTexture) {
  Seen seen = Look(0.0, 0.0), other = Look(0.3, 0.0);
  for (Seen* s : {&seen, &other}) {
    for (float& value : s->surface.luminance.data) value = 42.0f;
  }
  const Image depth =
      SweepPlanes({seen.surface.camera, seen.surface.cam_from_world, &seen.surface.luminance},
                  {{other.surface.camera, other.surface.cam_from_world, &other.surface.luminance}},
                  1.0,
                  9.0,
                  PlaneSweepOptions{},
                  {});
  for (float value : depth.data) {
    ASSERT_GE(value, 0.99f);
    ASSERT_LE(value, 9.01f);
  }
}

TEST(StereoViewsTest, PrefersSomeParallaxAndOverlap) {
  Scene scene;
  for (double x : {0.0, 0.01, 0.6, 3.9}) {
    View view;
    view.camera = {kWidth, kHeight, kFocal, kFocal, kWidth / 2.0, kHeight / 2.0};
    view.cam_from_world.translation = Eigen::Vector3d(-x, 0, 0);
    scene.views.push_back(view);
  }
  std::vector<Eigen::Vector3d> wall;
  for (double y = -1; y <= 1; y += 0.1) {
    for (double x = -1; x <= 1; x += 0.1) wall.emplace_back(x, y, kWallDepth);
  }
  const StereoPlan plan = PlanStereo(scene, 0, wall, {0, 1, 2, 3}, 4);
  ASSERT_EQ(plan.sources.size(), 2u)
      << "neither the view itself nor one that does not see the wall";
  EXPECT_EQ(plan.sources[0], 2);
  EXPECT_LT(plan.nearest, kWallDepth);
  EXPECT_GT(plan.farthest, kWallDepth);
  EXPECT_TRUE(PlanStereo(scene, 0, {}, {1, 2}, 4).sources.empty());
  EXPECT_TRUE(PlanStereo(scene, 0, wall, {0, 1, 2, 3}, 0).sources.empty());
}

class FusionTest : public testing::Test {
 protected:
  FusionTest()
      : luminance_(32, 24, 1, 60.0f),
        carried_{Image(32, 24, 2, 40.0f), Image(32, 24, 1)},
        inferred_(32, 24, 2, -20.0f) {}

  FusedColor Fuse(const Image& distance = {}, const Image& guess = {}) {
    return FuseColors(
        {luminance_, carried_, inferred_, distance, guess}, FusionOptions{}, pool_, {});
  }

  ThreadPool pool_{1};
  Image luminance_;
  CarriedColor carried_;
  Image inferred_;
};

TEST_F(FusionTest, KeepsInferredColorsWithoutCarried) {
  const FusedColor fused = Fuse();
  for (float value : fused.ab.data) EXPECT_NEAR(value, -20.0f, 0.1);
  for (size_t i = 0; i < luminance_.PlaneSize(); ++i) EXPECT_EQ(fused.provenance.Plane(2)[i], 1.0f);
}

TEST_F(FusionTest, FillsGapsFromCarriedNeighbors) {
  for (float& value : carried_.confidence.data) value = 1.0f;
  for (int y = 10; y < 13; ++y) {
    for (int x = 14; x < 17; ++x) carried_.confidence.At(0, y, x) = 0.0f;
  }
  const FusedColor fused = Fuse();
  EXPECT_GT(fused.ab.At(0, 11, 15), 30.0f);
  EXPECT_EQ(fused.provenance.At(1, 11, 15), 0.0f) << "filled, but not seen";
  EXPECT_GT(fused.provenance.At(1, 2, 2), 0.85f);
}

TEST_F(FusionTest, EachPixelHasItsOwnColorsWithoutSpread) {
  for (int x = 0; x < 16; ++x) carried_.confidence.At(0, 12, x) = 1.0f;
  FusionOptions options;
  options.spread = false;
  const FusedColor fused =
      FuseColors({luminance_, carried_, inferred_, {}, {}}, options, pool_, {});
  EXPECT_NEAR(fused.ab.At(0, 12, 15), 40.0f, 0.1);
  EXPECT_NEAR(fused.ab.At(0, 12, 16), -20.0f, 0.1);
  EXPECT_NEAR(fused.ab.At(0, 11, 15), -20.0f, 0.1);
}

TEST_F(FusionTest, KeepsColorsApartAtEdges) {
  for (int y = 0; y < 24; ++y) {
    for (int x = 0; x < 32; ++x) {
      if (x < 16) {
        luminance_.At(0, y, x) = 10.0f;
        carried_.confidence.At(0, y, x) = 1.0f;
      }
    }
  }
  const FusedColor fused = Fuse();
  EXPECT_GT(fused.ab.At(0, 12, 8), 30.0f);
  EXPECT_LT(fused.ab.At(0, 12, 24), -15.0f);
}

TEST_F(FusionTest, TakesFadedGuessFarFromTraining) {
  Image distance(32, 24, 1), guess(32, 24, 2, 10.0f);
  for (int y = 0; y < 24; ++y) {
    for (int x = 0; x < 32; ++x) {
      distance.At(0, y, x) = x < 16 ? 0.0f : 100.0f;
      luminance_.At(0, y, x) = x < 16 ? 10.0f : 90.0f;
    }
  }
  const FusedColor fused = Fuse(distance, guess);
  EXPECT_NEAR(fused.ab.At(0, 12, 4), -20.0, 1.0);
  EXPECT_NEAR(fused.ab.At(0, 12, 28), 0.1 * -20.0 + 0.9 * 0.7 * 10.0, 1.0);
  for (size_t i = 0; i < luminance_.PlaneSize(); ++i) {
    const double sum =
        fused.provenance.Plane(0)[i] + fused.provenance.Plane(1)[i] + fused.provenance.Plane(2)[i];
    ASSERT_NEAR(sum, 1.0, 1e-5);
  }
  EXPECT_NEAR(fused.provenance.At(0, 12, 28), 0.9, 1e-5);
}

TEST_F(FusionTest, TakesColorfulGuessFarFromTrainingOnly) {
  const Image guess(32, 24, 2, -30.0f);
  inferred_ = Image(32, 24, 2, 8.0f);
  const FusedColor strange = Fuse(Image(32, 24, 1, 3.2f), guess);
  EXPECT_NEAR(strange.ab.At(0, 12, 12), -30.0, 0.5);
  EXPECT_NEAR(strange.provenance.At(0, 12, 12), 1.0, 1e-5);
  const FusedColor known = Fuse(Image(32, 24, 1, 1.0f), guess);
  EXPECT_NEAR(known.ab.At(0, 12, 12), 8.0, 0.5);
}

TEST_F(FusionTest, RefusesPicturesOfOtherSize) {
  inferred_ = Image(5, 5, 2);
  EXPECT_THROW(Fuse(), Error);
}

}  // namespace
}  // namespace color3d
