#include "core/splat/geometry/exposure.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/random.h"

namespace color3d {
namespace {

constexpr int kWidth = 37, kHeight = 23;

PlaneBuffer Noise(double low, double high, uint64_t seed) {
  Random random(seed);
  PlaneBuffer planes(kWidth, kHeight, 1);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      planes.Row(0, y)[x] = static_cast<float>(random.NextUniform(low, high));
    }
  }
  return planes;
}

// Mean of the squared difference, and its gradient.
double Squares(const PlaneBuffer& x, const PlaneBuffer& y, PlaneBuffer& d) {
  d.Reset(x.width, x.height, 1);
  double sum = 0.0;
  const double n = x.width * x.height;
  for (int r = 0; r < x.height; ++r) {
    for (int k = 0; k < x.width; ++k) {
      const double e = x.Row(0, r)[k] - y.Row(0, r)[k];
      sum += e * e / n;
      d.Row(0, r)[k] = static_cast<float>(2.0 * e / n);
    }
  }
  return sum;
}

TEST(ExposureTest, FindsGainAndOffset) {
  ThreadPool pool(2);
  const PlaneBuffer scene = Noise(0.1, 0.9, 3);
  PhotoExposure truth, found;
  truth.log_gain = std::log(0.8);
  truth.offset = 0.07;
  PlaneBuffer photo, exposed, d;
  Expose(truth, scene, pool, photo);
  EXPECT_NEAR(photo.Row(0, 5)[7], 0.8 * scene.Row(0, 5)[7] + 0.07, 1e-6);
  for (int i = 0; i < 2000; ++i) {
    Expose(found, scene, pool, exposed);
    Squares(exposed, photo, d);
    FitExposure(scene, 0.01 * (1.0 - i / 2000.0), 0.0, pool, d, found);
  }
  EXPECT_NEAR(found.log_gain, truth.log_gain, 2e-3);
  EXPECT_NEAR(found.offset, truth.offset, 2e-3);
}

TEST(ExposureTest, GradientAgreesWithFiniteDifferences) {
  ThreadPool pool(2);
  const PlaneBuffer photo = Noise(0.2, 0.8, 4);
  PlaneBuffer drawn = Noise(0.1, 0.9, 5), exposed, d, unused;
  PhotoExposure exposure;
  exposure.log_gain = 0.2;
  exposure.offset = -0.05;
  const auto value = [&] {
    Expose(exposure, drawn, pool, exposed);
    return Squares(exposed, photo, unused);
  };
  Expose(exposure, drawn, pool, exposed);
  Squares(exposed, photo, d);
  PhotoExposure stepped = exposure;
  FitExposure(drawn, 0.001, 0.1, pool, d, stepped);
  const float h = 0.01f, saved = drawn.Row(0, 11)[13];
  drawn.Row(0, 11)[13] = saved + h;
  const double above = value();
  drawn.Row(0, 11)[13] = saved - h;
  const double below = value();
  EXPECT_NEAR(d.Row(0, 11)[13], (above - below) / (2.0 * h), 1e-5);
  EXPECT_EQ(stepped.steps, 1);
}

TEST(ExposureTest, IsCenteredForEveryThreadCount) {
  const PlaneBuffer photo = Noise(0.2, 0.8, 4), drawn = Noise(0.1, 0.9, 5);
  Exposures found(2);
  for (int k = 0; k < 2; ++k) {
    ThreadPool pool(k == 0 ? 1 : 3);
    PlaneBuffer d;
    Squares(drawn, photo, d);
    FitExposure(drawn, 0.01, 0.1, pool, d, found[k]);
  }
  EXPECT_EQ(found[0].log_gain, found[1].log_gain);
  EXPECT_EQ(found[0].offset, found[1].offset);
  found[0].log_gain += 0.5;
  Recenter(found);
  EXPECT_NEAR(found[0].log_gain, 0.25, 1e-12);
  EXPECT_NEAR(found[1].log_gain, -0.25, 1e-12);
  EXPECT_NEAR(found[0].offset, 0.0, 1e-12);
}

}  // namespace
}  // namespace color3d
