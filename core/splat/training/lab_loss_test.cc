#include "core/splat/training/lab_loss.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "core/base/random.h"
#include "core/color/lab.h"
#include "core/splat/model/color_layout.h"
#include "core/splat/raster/pipeline.h"
#include "core/splat/raster/raster_camera.h"
#include "tests/reference/splat.h"

namespace color3d {
namespace {

using Planes = std::vector<std::vector<double>>;

constexpr int kWidth = 28, kHeight = 20;
constexpr LossWeights kWeights{0.8f, 0.2f, 1.0f};

// L' varies over the range, a' and b' about neutral.
PlaneBuffer RandomPicture(uint64_t seed) {
  Random random(seed);
  PlaneBuffer p(kWidth, kHeight, 3);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        p.Row(c, y)[x] = static_cast<float>((c == 0 ? 0.5 : kNeutralChroma) +
                                            (c == 0 ? 0.3 : 0.1) * std::sin(0.3 * x + 0.2 * y * c) +
                                            random.NextUniform(-0.1, 0.1));
      }
    }
  }
  return p;
}

Planes ToPlanes(const PlaneBuffer& p) {
  Planes planes;
  for (int c = 0; c < p.channels; ++c) {
    planes.emplace_back();
    for (int y = 0; y < p.height; ++y) {
      planes.back().insert(planes.back().end(), p.Row(c, y), p.Row(c, y) + p.width);
    }
  }
  return planes;
}

// L_l + L_ab as printed, in float64.
double ReferenceLabLoss(const Planes& x, const Planes& y) {
  LossWeights of_ab = kWeights;
  of_ab.edge = 0.0f;
  return ReferenceLoss({x[0]}, {y[0]}, {}, kWidth, kHeight, kWeights) +
         ReferenceLoss({x[1], x[2]}, {y[1], y[2]}, {}, kWidth, kHeight, of_ab);
}

double FiniteDifference(double& variable, double step, const std::function<double()>& value) {
  const double saved = variable;
  variable = saved + step;
  const double above = value();
  variable = saved - step;
  const double below = value();
  variable = saved;
  return (above - below) / (2.0 * step);
}

TEST(LabLossTest, AgreesWithFloat64AndFiniteDifferences) {
  ThreadPool pool(2);
  const PlaneBuffer x = RandomPicture(1), y = RandomPicture(2);
  LabLoss loss;
  PlaneBuffer gradient;
  const LabLossValue value = loss.Evaluate(x, y, nullptr, kWeights, pool, gradient);
  Planes x64 = ToPlanes(x);
  const Planes y64 = ToPlanes(y);
  const auto reference = [&] { return ReferenceLabLoss(x64, y64); };
  EXPECT_NEAR(value.total(), reference(), 2e-6);
  EXPECT_EQ(value.ab.edge * kWeights.edge, 0.0);
  EXPECT_GT(value.l.edge, 0.0);
  Random random(7);
  for (int trial = 0; trial < 60; ++trial) {
    const int c = trial % 3;
    const int row = static_cast<int>(random.NextBelow(kHeight));
    const int column = static_cast<int>(random.NextBelow(kWidth));
    const double expected =
        FiniteDifference(x64[c][static_cast<size_t>(row) * kWidth + column], 1e-6, reference);
    EXPECT_NEAR(gradient.Row(c, row)[column], expected, 1e-3 / (kWidth * kHeight))
        << c << " " << row << " " << column;
  }
}

// A few large Gaussians with harmonics of degree 3 in all channels.
ParameterBlock Gaussians(const ColorLayout& layout) {
  Random random(5);
  ParameterBlock p(layout.rows(), 6);
  for (int i = 0; i < 6; ++i) {
    for (int k = 0; k < 3; ++k) {
      const double spread = k == 2 ? 0.3 : 0.6;
      p.Row(kPositionRow + k)[i] =
          static_cast<float>((k == 2 ? 2.0 + 0.2 * i : 0.0) + random.NextUniform(-spread, spread));
      p.Row(kLogScaleRow + k)[i] = static_cast<float>(random.NextUniform(-1.6, -1.0));
    }
    for (int k = 0; k < 4; ++k) {
      p.Row(kRotationRow + k)[i] = static_cast<float>(random.NextNormal());
    }
    p.Row(kOpacityRow)[i] = static_cast<float>(random.NextUniform(-1.0, 1.0));
    for (int r = kColorRow; r < layout.rows(); ++r) {
      p.Row(r)[i] = static_cast<float>(0.15 * random.NextNormal());
    }
  }
  return p;
}

// The whole chain of the joint training: parameters, picture, L_l + L_ab.
TEST(LabLossTest, JointGradientAgreesWithFiniteDifferences) {
  ThreadPool pool(1);
  const ColorLayout layout{ColorSpace::kLab, 3, 3, 3};
  const ColorSpec color = layout.Spec();
  const ParameterBlock parameters = Gaussians(layout);
  const RasterCamera camera =
      MakeRasterCamera(Camera{kWidth, kHeight, 24.0, 24.0, kWidth / 2.0, kHeight / 2.0}, Pose());
  const float background[3] = {0.0f, kNeutralChroma, kNeutralChroma};
  const PlaneBuffer target = RandomPicture(3);
  SplatPipeline pipeline;
  pipeline.Forward({parameters, color, camera}, background, false, pool);
  LabLoss loss;
  PlaneBuffer d_color;
  const LabLossValue value =
      loss.Evaluate(pipeline.color(), target, nullptr, kWeights, pool, d_color);
  ParameterBlock gradient;
  pipeline.Backward({parameters, color, camera}, d_color, pool, {GradientScope::kAll, gradient});

  ReferenceParameters reference = ReferenceParameters::From(parameters);
  const Planes y64 = ToPlanes(target);
  const auto total = [&] {
    const ReferenceImage image =
        ReferenceRender(reference, color, camera, {0.0, kNeutralChroma, kNeutralChroma});
    return ReferenceLabLoss(image.color, y64);
  };
  EXPECT_NEAR(value.total(), total(), 1e-4);
  double error = 0.0, size = 0.0;
  for (int row = 0; row < layout.rows(); ++row) {
    for (int i = 0; i < parameters.count(); ++i) {
      const double expected = FiniteDifference(reference.At(row, i), 1e-5, total);
      error += std::abs(gradient.Row(row)[i] - expected);
      size += std::abs(expected);
    }
  }
  // Pixels at the thresholds of alpha (1/255) step, so single derivatives may differ.
  EXPECT_LT(error, 0.02 * size);
  EXPECT_GT(std::abs(gradient.Row(layout.Row(2) + 15)[0]), 0.0f);
}

}  // namespace
}  // namespace color3d
