#include "core/splat/export/splat4d/splat4d.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/splat/motion/geometry_in_time.h"
#include "tests/support/formats/splat4d_reader.h"
#include "tests/support/scenes/random_model.h"

namespace color3d {
namespace {

constexpr size_t kCount = 60;
constexpr size_t kMovers = 25;

float Opacity(float logit) { return 1.0f / (1.0f + std::exp(-logit)); }

// The last Gaussians move over 2 s, turn, appear and vanish.
GaussianModel MovingModel() {
  GaussianModel model = RandomModel({kCount, 3, 0, 0, /*chroma_size=*/0.03});
  Random random(5);
  const auto fill = [&](std::vector<float>& row, size_t width, double size) {
    for (size_t i = 0; i < kMovers * width; ++i) {
      row.push_back(static_cast<float>(size * random.NextNormal()));
    }
  };
  model.motion.begin_s = 1.0;
  model.motion.end_s = 3.0;
  fill(model.motion.velocity, 3, 0.5);
  fill(model.motion.acceleration, 3, 0.2);
  fill(model.motion.spin, 4, 0.8);
  fill(model.motion.center, 1, 0.5);
  fill(model.motion.log_width, 1, 0.3);
  return model;
}

// Nearest Gaussian by the attributes that do not change.
size_t PartnerOf(const ViewerGaussians& g, size_t i, const Splat4dFrame& frame) {
  size_t nearest = 0;
  double least = HUGE_VAL;
  for (size_t j = 0; j < frame.opacity.size(); ++j) {
    double distance = 0.0;
    for (int k = 0; k < 3; ++k) {
      distance += std::abs(g.log_scale[3 * i + k] - frame.log_scale[3 * j + k]);
    }
    if (distance < least) least = distance, nearest = j;
  }
  EXPECT_LT(least, 3.0 * std::log(1.01));
  return nearest;
}

class Splat4dTest : public testing::Test {
 protected:
  std::string Encode(const GaussianModel& model, int frames) {
    return EncodeSplat4d(model, FitRgbHarmonics(model, pool_), frame_, frames, pool_);
  }

  ThreadPool pool_{2};
  ExportFrame frame_{2.0, {1.0, -2.0, 3.0}};
};

TEST_F(Splat4dTest, RoundTripsWithinErrorBounds) {
  const GaussianModel model = MovingModel();
  const int frames = 67;  // three groups, of which the last is short
  const Splat4dFile file = ReadSplat4d(Encode(model, frames));
  ASSERT_EQ(file.frames.size(), static_cast<size_t>(frames));
  EXPECT_NEAR(file.frames_per_second, (frames - 1) / 2.0, 1e-9);
  EXPECT_GT(file.moving, kMovers / 2);
  EXPECT_LE(file.moving, kMovers);
  const ViewerGaussians whole = ForViewers(model, FitRgbHarmonics(model, pool_), frame_, pool_);
  for (int f = 0; f < frames; ++f) {
    GaussianModel at = model;
    const ParameterBlock parameters = ParametersAt(model, 1.0 + 2.0 * f / (frames - 1), pool_);
    for (size_t i = 0; i < kCount; ++i) {
      for (int k = 0; k < 3; ++k) at.position[3 * i + k] = parameters.Row(kPositionRow + k)[i];
      for (int k = 0; k < 4; ++k) at.rotation[4 * i + k] = parameters.Row(kRotationRow + k)[i];
      at.opacity_logit[i] = parameters.Row(kOpacityRow)[i];
    }
    const ViewerGaussians truth = ForViewers(at, FitRgbHarmonics(at, pool_), frame_, pool_);
    const Splat4dFrame& frame = file.frames[f];
    for (size_t i = 0; i < kCount; ++i) {
      const size_t j = PartnerOf(whole, i, frame);
      const double opacity = 255.0 * Opacity(truth.opacity_logit[i]);
      EXPECT_NEAR(frame.opacity[j], opacity, 1.51);
      if (opacity < 0.5) continue;
      double dot = 0.0, norm = 0.0;
      for (int k = 0; k < 4; ++k) {
        dot += truth.rotation[4 * i + k] * frame.rotation[4 * j + k];
        norm += frame.rotation[4 * j + k] * frame.rotation[4 * j + k];
      }
      EXPECT_GT(std::abs(dot) / std::sqrt(norm), 0.9999);
      for (int k = 0; k < 3; ++k) {
        const double x = truth.position[3 * i + k];
        EXPECT_NEAR(frame.position[3 * j + k], x, file.position_bound + 1e-5) << f << ' ' << i;
        EXPECT_GE(x, file.box[k] - 1e-5);
        EXPECT_LE(x, file.box[3 + k] + 1e-5);
        EXPECT_NEAR(frame.color[3 * j + k], 255.0 * (0.5 + 0.28209479 * truth.sh[3 * i + k]), 0.51);
      }
    }
  }
}

TEST_F(Splat4dTest, SamplesDeformationField) {
  GaussianModel model = RandomModel({kCount, 3, 0, 0, /*chroma_size=*/0.03});
  model.hexplane = RandomHexPlanes();
  const int frames = 7;
  const Splat4dFile file = ReadSplat4d(Encode(model, frames));
  ASSERT_EQ(file.frames.size(), static_cast<size_t>(frames));
  double moved = 0.0, grown = 0.0;
  for (int f = 0; f < frames; ++f) {
    const GaussianModel at = ModelAt(model, 1.0 + 2.0 * f / (frames - 1), pool_);
    const ViewerGaussians truth = ForViewers(at, FitRgbHarmonics(at, pool_), frame_, pool_);
    const Splat4dFrame& frame = file.frames[f];
    for (size_t i = 0; i < kCount; ++i) {
      const size_t j = PartnerOf(truth, i, frame);
      for (int k = 0; k < 3; ++k) {
        const double x = truth.position[3 * i + k], s = truth.log_scale[3 * i + k];
        EXPECT_NEAR(frame.position[3 * j + k], x, file.position_bound + 1e-5) << f << ' ' << i;
        EXPECT_NEAR(frame.log_scale[3 * j + k], s, std::log(1.01) + 1e-5) << f << ' ' << i;
        const Splat4dFrame& first = file.frames.front();
        moved = std::max(moved, std::abs(frame.position[3 * j + k] - first.position[3 * j + k]));
        grown = std::max(grown, std::abs(frame.log_scale[3 * j + k] - first.log_scale[3 * j + k]));
      }
    }
  }
  EXPECT_GT(moved, 0.01);
  EXPECT_GT(grown, 0.01);
}

TEST_F(Splat4dTest, StaticGaussiansAreStoredOnce) {
  GaussianModel model = MovingModel();
  for (auto* part : {&model.motion.velocity, &model.motion.acceleration, &model.motion.spin}) {
    std::fill(part->begin(), part->end(), 0.0f);
  }
  std::fill(model.motion.log_width.begin(), model.motion.log_width.end(), 5.0f);
  const std::string few = Encode(model, 2), many = Encode(model, 30);
  EXPECT_EQ(ReadSplat4d(many).moving, 0u);
  EXPECT_LT(many.size(), few.size() + 100);
}

TEST_F(Splat4dTest, OmitsGaussiansInvisibleInAllFrames) {
  GaussianModel model = MovingModel();
  model.opacity_logit[0] = -20.0f;           // static
  model.opacity_logit[kCount - 1] = -20.0f;  // moves
  const Splat4dFile file = ReadSplat4d(Encode(model, 5));
  EXPECT_EQ(file.frames.front().opacity.size(), kCount - 2);
  std::fill(model.opacity_logit.begin(), model.opacity_logit.end(), -20.0f);
  EXPECT_THROW(Encode(model, 5), Error);
}

TEST_F(Splat4dTest, EncodesOneFrameAndStaticModel) {
  EXPECT_EQ(ReadSplat4d(Encode(MovingModel(), 1)).frames.size(), 1u);
  const GaussianModel still = RandomModel({kCount, 3, 1, 0, /*chroma_size=*/0.03});
  const Splat4dFile file = ReadSplat4d(Encode(still, 3));
  EXPECT_EQ(file.moving, 0u);
  EXPECT_EQ(file.frames.size(), 3u);
}

TEST_F(Splat4dTest, RejectsUnsupportedModels) {
  GaussianModel model = MovingModel();
  EXPECT_THROW(Encode(model, 0), Error);
  EXPECT_THROW(Encode(model, kMaxSplat4dFrames + 1), Error);
  EXPECT_THROW(Encode(GaussianModel{}, 1), Error);
  model.motion.velocity[4] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(Encode(model, 3), Error);
}

}  // namespace
}  // namespace color3d
