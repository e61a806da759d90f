// Stiff and extreme cases (METHOD.md "Stability"): no non-finite value or gradient, whatever the
// Gaussians look like, and agreement with float64 where the float64 answer is meaningful.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "core/base/random.h"
#include "core/splat/pipeline.h"
#include "core/splat/reference.h"

namespace color3d {
namespace {

constexpr int kRows = kColorRow + 4;
const float kBlack = 0.0f;

RasterCamera FrontCamera(int width, int height) {
  RasterCamera c;
  c.width = width;
  c.height = height;
  c.fx = c.fy = 40.0f;
  c.cx = 0.5f * static_cast<float>(width);
  c.cy = 0.5f * static_cast<float>(height);
  return c;
}

ColorSpec Luminance() {
  ColorSpec color;
  color.channel[0].coefficients = 4;
  return color;
}

// Ordinary Gaussians two units before the camera.
ParameterBlock Ordinary(int count) {
  Random random(2);
  ParameterBlock p(kRows, count);
  for (int i = 0; i < count; ++i) {
    p.Row(0)[i] = static_cast<float>(random.NextUniform(-0.4, 0.4));
    p.Row(1)[i] = static_cast<float>(random.NextUniform(-0.4, 0.4));
    p.Row(2)[i] = static_cast<float>(random.NextUniform(1.5, 2.5));
    for (int k = 0; k < 3; ++k) p.Row(kLogScaleRow + k)[i] = -2.5f;
    for (int k = 0; k < 4; ++k)
      p.Row(kRotationRow + k)[i] = static_cast<float>(random.NextNormal());
    p.Row(kOpacityRow)[i] = 0.5f;
    for (int k = 0; k < 4; ++k) p.Row(kColorRow + k)[i] = 0.3f;
  }
  return p;
}

struct Drawn {
  PlaneBuffer color;
  ParameterBlock gradient;
};

// Draws, asks for the gradient of the sum of all pixels, and checks that all of it is finite.
Drawn DrawAndCheckFinite(const ParameterBlock& p, const RasterCamera& camera) {
  ThreadPool pool(2);
  SplatPipeline pipeline;
  pipeline.Forward(p, Luminance(), camera, &kBlack, false, pool);
  PlaneBuffer ones(camera.width, camera.height, 1);
  for (int y = 0; y < camera.height; ++y) std::fill_n(ones.Row(0, y), camera.width, 1.0f);
  Drawn drawn;
  DensifyStatistics statistics;
  statistics.Reset(p.count());
  pipeline.Backward(
      p, Luminance(), camera, ones, GradientScope::kAll, pool, drawn.gradient, &statistics);
  drawn.color = pipeline.color();
  for (const float v : drawn.color.data) EXPECT_TRUE(std::isfinite(v));
  for (const float v : drawn.gradient.values()) EXPECT_TRUE(std::isfinite(v));
  for (const float v : statistics.gradient) EXPECT_TRUE(std::isfinite(v));
  return drawn;
}

double WorstDifference(const ParameterBlock& p, const RasterCamera& camera, const Drawn& drawn) {
  const ReferenceImage image =
      ReferenceRender(ReferenceParameters::From(p), Luminance(), camera, {0.0});
  double worst = 0.0;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      worst = std::max(worst,
                       std::abs(drawn.color.Row(0, y)[x] -
                                image.color[0][static_cast<size_t>(y) * camera.width + x]));
    }
  }
  return worst;
}

TEST(SplatStabilityTest, NeedlesOfAMillionToOne) {
  const RasterCamera camera = FrontCamera(48, 40);
  ParameterBlock p = Ordinary(40);
  for (int i = 0; i < 40; ++i) {
    p.Row(kLogScaleRow + i % 3)[i] = std::log(10.0f);
    p.Row(kLogScaleRow + (i + 1) % 3)[i] = std::log(1e-5f);
    p.Row(kLogScaleRow + (i + 2) % 3)[i] = std::log(1e-5f);
  }
  const Drawn drawn = DrawAndCheckFinite(p, camera);
  EXPECT_LT(WorstDifference(p, camera, drawn), 2e-3);
}

TEST(SplatStabilityTest, ScalesFromTinyToHuge) {
  const RasterCamera camera = FrontCamera(48, 40);
  for (const double scale : {1e-8, 1e-4, 1e2, 1e4, 1e6, 1e30}) {
    ParameterBlock p = Ordinary(20);
    for (int i = 0; i < 20; ++i) {
      for (int k = 0; k < 3; ++k) {
        p.Row(kLogScaleRow + k)[i] = static_cast<float>(std::log(scale));
      }
    }
    const Drawn drawn = DrawAndCheckFinite(p, camera);
    if (scale <= 1e4) {
      EXPECT_LT(WorstDifference(p, camera, drawn), 1e-3) << scale;
    }
  }
}

TEST(SplatStabilityTest, ZeroTinyAndHugeQuaternions) {
  const RasterCamera camera = FrontCamera(48, 40);
  for (const float size : {0.0f, 1e-20f, 1e-6f, 1e18f}) {
    ParameterBlock p = Ordinary(20);
    for (int i = 0; i < 20; ++i) {
      for (int k = 0; k < 4; ++k) p.Row(kRotationRow + k)[i] *= size;
    }
    DrawAndCheckFinite(p, camera);
  }
}

TEST(SplatStabilityTest, OpacityAtBothEnds) {
  const RasterCamera camera = FrontCamera(48, 40);
  ParameterBlock p = Ordinary(20);
  for (int i = 0; i < 20; ++i) p.Row(kOpacityRow)[i] = i % 2 == 0 ? 40.0f : -40.0f;
  const Drawn drawn = DrawAndCheckFinite(p, camera);
  EXPECT_LT(WorstDifference(p, camera, drawn), 1e-4);
  for (int i = 0; i < 20; ++i) p.Row(kOpacityRow)[i] = i % 2 == 0 ? 1e30f : -1e30f;
  DrawAndCheckFinite(p, camera);
}

TEST(SplatStabilityTest, TenThousandSplatsOnOnePixel) {
  const RasterCamera camera = FrontCamera(33, 33);
  const int count = 10'000;
  ParameterBlock p(kRows, count);
  Random random(5);
  for (int i = 0; i < count; ++i) {
    p.Row(2)[i] = static_cast<float>(random.NextUniform(1.0, 3.0));
    for (int k = 0; k < 3; ++k) p.Row(kLogScaleRow + k)[i] = -12.0f;
    p.Row(kRotationRow)[i] = 1.0f;
    p.Row(kOpacityRow)[i] = -4.0f;
    p.Row(kColorRow)[i] = static_cast<float>(random.NextUniform(-1.0, 1.0));
  }
  const Drawn drawn = DrawAndCheckFinite(p, camera);
  EXPECT_LT(WorstDifference(p, camera, drawn), 1e-3);
}

TEST(SplatStabilityTest, CameraInsideAndPointsNearAndBehindThePlane) {
  const RasterCamera camera = FrontCamera(48, 40);
  ParameterBlock p = Ordinary(64);
  const float depths[] = {-10.0f, -0.2f, 0.0f, 1e-7f, 0.19999f, 0.2f, 0.20001f, 0.3f};
  for (int i = 0; i < 64; ++i) {
    p.Row(2)[i] = depths[i % 8];
    p.Row(0)[i] = i < 32 ? 0.0f : 100.0f;  // straight ahead; far out to the side
    for (int k = 0; k < 3; ++k) p.Row(kLogScaleRow + k)[i] = i % 3 == 0 ? 1.0f : -3.0f;
  }
  const Drawn drawn = DrawAndCheckFinite(p, camera);
  for (int i = 0; i < 64; ++i) {
    if (i % 8 < 5) {
      EXPECT_EQ(drawn.gradient.Row(kColorRow)[i], 0.0f) << "behind the near plane";
    }
  }
}

TEST(SplatStabilityTest, HugeAndNonFinitePositionsAreNotDrawn) {
  const RasterCamera camera = FrontCamera(48, 40);
  ParameterBlock p = Ordinary(20);
  const Drawn clean = DrawAndCheckFinite(p, camera);
  ParameterBlock more = p;
  more.Resize(24);
  const float bad[] = {
      1e30f, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN(), 1e6f};
  for (int i = 0; i < 4; ++i) {
    more.CopyGaussian(0, 20 + i);
    more.Row(0)[20 + i] = bad[i];
  }
  ThreadPool pool(2);
  SplatPipeline pipeline;
  pipeline.Forward(more, Luminance(), camera, &kBlack, false, pool);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      EXPECT_EQ(pipeline.color().Row(0, y)[x], clean.color.Row(0, y)[x]);
    }
  }
}

TEST(SplatStabilityTest, PicturesOfOnePixelAndOneRow) {
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 50}, {50, 1}, {16, 16}, {17, 15}}) {
    const RasterCamera camera = FrontCamera(width, height);
    const ParameterBlock p = Ordinary(30);
    const Drawn drawn = DrawAndCheckFinite(p, camera);
    EXPECT_LT(WorstDifference(p, camera, drawn), 2e-5) << width << "x" << height;
  }
}

TEST(SplatStabilityTest, NoGaussiansGiveTheBackground) {
  ThreadPool pool(2);
  const RasterCamera camera = FrontCamera(20, 20);
  const ParameterBlock p(kRows, 0);
  SplatPipeline pipeline;
  const float background = 0.25f;
  pipeline.Forward(p, Luminance(), camera, &background, false, pool);
  EXPECT_EQ(pipeline.color().Row(0, 19)[19], 0.25f);
}

}  // namespace
}  // namespace color3d
