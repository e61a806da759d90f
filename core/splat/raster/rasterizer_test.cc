#include "core/splat/raster/rasterizer.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "core/base/random.h"
#include "core/splat/raster/pipeline.h"
#include "tests/reference/splat.h"
#include "tests/support/instruction_set_testing.h"

namespace color3d {
namespace {

// Luminance with nine coefficients, then two chroma channels with four each.
ColorSpec TestColor(int channels) {
  ColorSpec color;
  color.channels = channels;
  if (channels == 2) {
    color.channel[0] = {kColorRow, 4, 0.5f, false};
    color.channel[1] = {kColorRow + 4, 4, 0.5f, false};
  } else {
    color.channel[0] = {kColorRow, 9, 0.5f, true};
    color.channel[1] = {kColorRow + 9, 4, 0.5f, false};
    color.channel[2] = {kColorRow + 13, 4, 0.5f, false};
  }
  return color;
}
constexpr int kTestRows = kColorRow + 17;

RasterCamera TestCamera(int width, int height) {
  RasterCamera c;
  c.width = width;
  c.height = height;
  c.fx = 0.9f * static_cast<float>(width);
  c.fy = 0.95f * static_cast<float>(width);
  c.cx = 0.48f * static_cast<float>(width);
  c.cy = 0.53f * static_cast<float>(height);
  // 0.3 rad about y.
  const float s = std::sin(0.3f), k = std::cos(0.3f);
  const float rotation[9] = {k, 0, s, 0, 1, 0, -s, 0, k};
  std::copy(rotation, rotation + 9, c.rotation);
  c.translation[0] = 0.1f;
  c.translation[1] = -0.2f;
  c.translation[2] = 0.4f;
  for (int a = 0; a < 3; ++a) {
    c.center[a] = 0.0f;
    for (int b = 0; b < 3; ++b) c.center[a] -= c.rotation[3 * b + a] * c.translation[b];
  }
  return c;
}

ParameterBlock RandomGaussians(int count, uint64_t seed) {
  Random random(seed);
  ParameterBlock p(kTestRows, count);
  for (int i = 0; i < count; ++i) {
    p.Row(0)[i] = static_cast<float>(random.NextUniform(-1.5, 1.0));
    p.Row(1)[i] = static_cast<float>(random.NextUniform(-1.0, 1.2));
    p.Row(2)[i] = static_cast<float>(random.NextUniform(2.0, 4.0));
    for (int k = 0; k < 3; ++k) {
      p.Row(kLogScaleRow + k)[i] = static_cast<float>(random.NextUniform(-3.5, -1.2));
    }
    for (int k = 0; k < 4; ++k)
      p.Row(kRotationRow + k)[i] = static_cast<float>(random.NextNormal());
    p.Row(kOpacityRow)[i] = static_cast<float>(random.NextUniform(-2.0, 2.5));
    for (int r = kColorRow; r < kTestRows; ++r) {
      p.Row(r)[i] = static_cast<float>(random.NextUniform(-0.3, 0.3));
    }
  }
  return p;
}

PlaneBuffer RandomWeights(int width, int height, int channels, uint64_t seed) {
  Random random(seed);
  PlaneBuffer w(width, height, channels);
  for (int c = 0; c < channels; ++c) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        w.Row(c, y)[x] = static_cast<float>(random.NextUniform(-1.0, 1.0));
      }
    }
  }
  return w;
}

double WeightedSum(const ReferenceImage& image, const PlaneBuffer& weights) {
  double sum = 0.0;
  for (int c = 0; c < weights.channels; ++c) {
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        sum += weights.Row(c, y)[x] * image.color[c][static_cast<size_t>(y) * image.width + x];
      }
    }
  }
  return sum;
}

const float kBackground[4] = {0.2f, 0.5f, 0.6f, 0.0f};
const std::vector<double> kBackground64 = {0.2f, 0.5f, 0.6f};

using RasterTest = InstructionSetTest<int>;  // of channel counts

TEST_P(RasterTest, PictureAgreesWithFloat64Reference) {
  ThreadPool pool(2);
  const int channels = TestCase();
  const int width = 61, height = 45;
  const RasterCamera camera = TestCamera(width, height);
  const ParameterBlock p = RandomGaussians(200, 3);
  const ColorSpec color = TestColor(channels);
  SplatPipeline pipeline;
  pipeline.Forward({p, color, camera}, kBackground, true, pool);
  const ReferenceImage image =
      ReferenceRender(ReferenceParameters::From(p), color, camera, kBackground64);
  double worst = 0.0, worst_depth = 0.0, spread = 0.0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const size_t i = static_cast<size_t>(y) * width + x;
      for (int c = 0; c < channels; ++c) {
        worst = std::max(worst, std::abs(pipeline.color().Row(c, y)[x] - image.color[c][i]));
        spread = std::max(spread, std::abs(image.color[c][i] - kBackground64[c]));
      }
      worst =
          std::max(worst, std::abs(1.0 - pipeline.transmittance().Row(0, y)[x] - image.opacity[i]));
      worst_depth =
          std::max(worst_depth, std::abs(pipeline.color().Row(channels, y)[x] - image.depth[i]));
    }
  }
  EXPECT_GT(spread, 0.2);  // something is drawn
  EXPECT_LT(worst, 2e-5);
  EXPECT_LT(worst_depth, 1e-4);
}

TEST_P(RasterTest, GradientsAgreeWithFiniteDifferencesOfTheReference) {
  ThreadPool pool(2);
  const int channels = TestCase();
  const int width = 37, height = 29;
  const RasterCamera camera = TestCamera(width, height);
  const ParameterBlock p = RandomGaussians(24, 11);
  const ColorSpec color = TestColor(channels);
  const PlaneBuffer weights = RandomWeights(width, height, channels, 5);
  SplatPipeline pipeline;
  pipeline.Forward({p, color, camera}, kBackground, false, pool);
  ParameterBlock gradient;
  pipeline.Backward({p, color, camera}, weights, pool, {GradientScope::kAll, gradient});
  ReferenceParameters r = ReferenceParameters::From(p);
  const auto value = [&] {
    return WeightedSum(ReferenceRender(r, color, camera, kBackground64), weights);
  };
  for (int row = 0; row < kTestRows; ++row) {
    double scale = 0.0, worst = 0.0;
    int worst_index = 0;
    for (int i = 0; i < r.count; ++i) {
      const double saved = r.At(row, i), h = 1e-6;
      r.At(row, i) = saved + h;
      const double above = value();
      r.At(row, i) = saved - h;
      const double below = value();
      r.At(row, i) = saved;
      const double expected = (above - below) / (2.0 * h);
      const double difference = std::abs(gradient.Row(row)[i] - expected);
      scale = std::max(scale, std::abs(expected));
      if (difference > worst) {
        worst = difference;
        worst_index = i;
      }
    }
    EXPECT_LE(worst, 1e-3 * scale) << "row " << row << " Gaussian " << worst_index;
  }
}

// The Gaussians that `dropping` keeps, with its factor on their opacity.
ReferenceParameters Kept(const ParameterBlock& p,
                         const SplatDropping& dropping,
                         ThreadPool& pool,
                         std::vector<int>& kept) {
  SplatBuffer all;
  all.row_floats = SplatRowFloats(1);
  all.depth_key.assign(p.count(), 1u);
  all.rows.assign(p.count() * all.row_floats, 0.0f);
  DropSplats(dropping, pool, all);
  ParameterBlock block = p;
  std::vector<uint32_t> source;
  for (int i = 0; i < p.count(); ++i) {
    if (all.depth_key[i] == 0) continue;
    kept.push_back(i);
    source.push_back(static_cast<uint32_t>(i));
  }
  block.Gather(source);
  ReferenceParameters r = ReferenceParameters::From(block);
  for (int i = 0; i < r.count; ++i) {
    const double opacity = 1.0 / (1.0 + std::exp(-r.At(kOpacityRow, i))) / (1.0 - dropping.rate);
    r.At(kOpacityRow, i) = std::log(opacity / (1.0 - opacity));
  }
  return r;
}

TEST_P(RasterTest, DroppedGaussiansHaveNoEffect) {
  ThreadPool pool(2);
  const int channels = TestCase(), width = 37, height = 29;
  const RasterCamera camera = TestCamera(width, height);
  ParameterBlock p = RandomGaussians(40, 11);
  for (int i = 0; i < p.count(); ++i)
    p.Row(kOpacityRow)[i] -= 2.0f;  // so that 1.33 times stays < 1
  const ColorSpec color = TestColor(channels);
  const SplatDropping dropping{0.25, 7};
  std::vector<int> kept;
  const ReferenceParameters r = Kept(p, dropping, pool, kept);
  ASSERT_GT(kept.size(), 20u);
  ASSERT_LT(kept.size(), 38u);
  const PlaneBuffer weights = RandomWeights(width, height, channels, 5);
  SplatPipeline pipeline;
  pipeline.Forward({p, color, camera}, kBackground, false, pool, dropping);
  const ReferenceImage image = ReferenceRender(r, color, camera, kBackground64);
  std::vector<ReferencePixel> pixels;
  std::vector<std::array<double, 3>> d_color;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      ReferencePixel pixel;
      pixel.x = x;
      pixel.y = y;
      pixels.push_back(pixel);
      d_color.push_back({});
      for (int c = 0; c < channels; ++c) {
        d_color.back()[c] = weights.Row(c, y)[x];
        EXPECT_NEAR(pipeline.color().Row(c, y)[x], image.color[c][y * width + x], 2e-5);
      }
    }
  }
  ParameterBlock gradient;
  pipeline.Backward({p, color, camera}, weights, pool, {GradientScope::kAll, gradient});
  ReferenceParameters expected =
      ReferenceGradient(r, color, camera, kBackground64, pixels, d_color);
  for (int k = 0; k < r.count; ++k) {  // by the logit before the factor
    const double before = 1.0 / (1.0 + std::exp(-p.Row(kOpacityRow)[kept[k]]));
    const double after = before / (1.0 - dropping.rate);
    expected.At(kOpacityRow, k) *= (1.0 - before) / (1.0 - after);
  }
  for (int row = 0; row < kTestRows; ++row) {
    double scale = 0.0, worst = 0.0, sum_kept = 0.0, sum_all = 0.0;
    for (int k = 0; k < r.count; ++k) {
      const double got = gradient.Row(row)[kept[k]];
      scale = std::max(scale, std::abs(expected.At(row, k)));
      worst = std::max(worst, std::abs(got - expected.At(row, k)));
      sum_kept += std::abs(got);
    }
    for (int i = 0; i < p.count(); ++i) sum_all += std::abs(gradient.Row(row)[i]);
    EXPECT_LE(worst, 1e-3 * scale) << "row " << row;
    EXPECT_DOUBLE_EQ(sum_all, sum_kept) << "row " << row;  // dropped Gaussians have no gradient
  }
}

// Moving the principal point moves all centres equally, so a picture of one Gaussian gives dL/d(u,
// v) by finite differences of the reference.
TEST_P(RasterTest, ScreenGradientsAgreeWithTheReference) {
  ThreadPool pool(2);
  const int channels = TestCase(), width = 41, height = 35;
  const RasterCamera camera = TestCamera(width, height);
  const ColorSpec color = TestColor(channels);
  const PlaneBuffer weights = RandomWeights(width, height, channels, 5);
  for (const uint64_t seed : {21, 22, 23}) {
    const ParameterBlock p = RandomGaussians(1, seed);
    double sums[2] = {0.0, 0.0}, plain[2] = {0.0, 0.0};  // of |dL/d(u, v)| and of dL/d(u, v)
    for (int axis = 0; axis < 2; ++axis) {
      const float h = 1e-3f;
      RasterCamera moved[2] = {camera, camera};
      (axis == 0 ? moved[0].cx : moved[0].cy) -= h;
      (axis == 0 ? moved[1].cx : moved[1].cy) += h;
      const double step =
          axis == 0 ? double{moved[1].cx} - moved[0].cx : double{moved[1].cy} - moved[0].cy;
      const ReferenceParameters r = ReferenceParameters::From(p);
      const ReferenceImage below = ReferenceRender(r, color, moved[0], kBackground64);
      const ReferenceImage above = ReferenceRender(r, color, moved[1], kBackground64);
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          const size_t i = static_cast<size_t>(y) * width + x;
          double d = 0.0;
          for (int c = 0; c < channels; ++c) {
            d += weights.Row(c, y)[x] * (above.color[c][i] - below.color[c][i]) / step;
          }
          // A pixel that crosses alpha = 1/255 between the two jumps.
          if ((above.opacity[i] == 0.0) != (below.opacity[i] == 0.0)) continue;
          sums[axis] += std::abs(d);
          plain[axis] += d;
        }
      }
      sums[axis] *= 0.5 * (axis == 0 ? width : height);
      plain[axis] *= 0.5 * (axis == 0 ? width : height);
    }
    SplatPipeline pipeline;
    pipeline.Forward({p, color, camera}, kBackground, false, pool);
    DensifyStatistics statistics;
    statistics.Reset(1);
    ParameterBlock gradient;
    pipeline.Backward(
        {p, color, camera}, weights, pool, {GradientScope::kAll, gradient, &statistics});
    const double norm = std::hypot(plain[0], plain[1]);
    EXPECT_GT(norm, 0.1);
    EXPECT_NEAR(statistics.gradient[0], norm, 3e-3 * std::hypot(sums[0], sums[1]));
  }
}

INSTANTIATE_TEST_SUITE_P(Channels,
                         RasterTest,
                         testing::Combine(testing::Values(1, 2, 3), EachInstructionSet()));

TEST(RasterizerTest, IsIndependentOfTilesAndThreads) {
  const RasterCamera camera = TestCamera(131, 77);
  const ParameterBlock p = RandomGaussians(500, 8);
  const ColorSpec color = TestColor(3);
  const PlaneBuffer weights = RandomWeights(131, 77, 3, 6);
  ParameterBlock gradients[2];
  AlignedFloats pictures[2];
  for (int run = 0; run < 2; ++run) {
    ThreadPool pool(run == 0 ? 1 : 3);
    SplatPipeline pipeline;
    pipeline.Forward({p, color, camera}, kBackground, false, pool);
    pictures[run] = pipeline.color().data;
    pipeline.Backward({p, color, camera}, weights, pool, {GradientScope::kAll, gradients[run]});
  }
  EXPECT_EQ(pictures[0], pictures[1]);
  EXPECT_EQ(gradients[0].values(), gradients[1].values());
}

TEST(RasterizerTest, ColorOnlyGradientEqualsFullGradient) {
  ThreadPool pool(2);
  const RasterCamera camera = TestCamera(64, 48);
  const ParameterBlock p = RandomGaussians(60, 9);
  const ColorSpec color = TestColor(2);
  const PlaneBuffer weights = RandomWeights(64, 48, 2, 6);
  SplatPipeline pipeline;
  pipeline.Forward({p, color, camera}, kBackground, false, pool);
  ParameterBlock all, only;
  pipeline.Backward({p, color, camera}, weights, pool, {GradientScope::kAll, all});
  pipeline.Backward({p, color, camera}, weights, pool, {GradientScope::kColorOnly, only});
  for (int i = 0; i < p.count(); ++i) {
    EXPECT_EQ(only.Row(kPositionRow)[i], 0.0f);
    for (int k = 0; k < 8; ++k) EXPECT_EQ(only.Row(kColorRow + k)[i], all.Row(kColorRow + k)[i]);
  }
}

}  // namespace
}  // namespace color3d
