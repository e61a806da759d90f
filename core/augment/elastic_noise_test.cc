#include "core/augment/elastic_noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace color3d {
namespace {

constexpr int kSize = 256;

ElasticOptions Noise(double alpha_px, double sigma_px, double affine_px) {
  return {ElasticOptions::Kind::kNoise, alpha_px, sigma_px, affine_px};
}

// Mean of u(x) u(x + lag) over the horizontal component.
double Covariance(const ElasticNoise& noise, int lag) {
  double sum = 0.0;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x + lag < kSize; ++x) sum += noise.At(x, y).x * noise.At(x + lag, y).x;
  }
  return sum / (kSize * (kSize - lag));
}

// Uniform noise in -1..1 has a variance of 1/3; a Gaussian of sigma px divides it by 4 pi sigma^2
// and correlates it as exp(-lag^2 / (4 sigma^2)).
TEST(ElasticNoiseTest, HasCovarianceOfBlurredNoise) {
  constexpr double kAlpha = 100.0, kSigma = 4.0;
  Random random(11);
  const ElasticNoise noise(kSize, kSize, Noise(kAlpha, kSigma, 0.0), random);
  const double variance = kAlpha * kAlpha / 3.0 / (4.0 * std::numbers::pi * kSigma * kSigma);
  EXPECT_NEAR(Covariance(noise, 0) / variance, 1.0, 0.15);
  EXPECT_NEAR(Covariance(noise, 4) / Covariance(noise, 0), std::exp(-0.25), 0.06);
  EXPECT_NEAR(Covariance(noise, 16) / Covariance(noise, 0), 0.0, 0.15);
}

// The values of the released code: the noise alone does not move a picture.
TEST(ElasticNoiseTest, MovesLessThanAPixelAtAlpha15Sigma50) {
  Random random(5);
  const ElasticNoise noise(kSize, kSize, Noise(15.0, 50.0, 0.0), random);
  for (int i = 0; i < kSize; ++i) {
    EXPECT_LT(std::abs(noise.At(i, i).x), 1.0);
    EXPECT_LT(std::abs(noise.At(i, i).y), 1.0);
  }
  EXPECT_GT(Covariance(noise, 0), 0.0);
}

TEST(ElasticNoiseTest, WithoutAffineMapIsNoiseAlone) {
  Random random(3);
  const ElasticNoise noise(16, 300, Noise(15.0, 4.0, 0.0), random);
  const PlanePoint p = noise.Affine({7.0, -3.0});
  EXPECT_EQ(p.x, 7.0);
  EXPECT_EQ(p.y, -3.0);
}

TEST(ElasticNoiseTest, AffineMapMovesCornersByItsBound) {
  constexpr double kAffine = 20.0;
  constexpr double kSide = 2.0 * 300 / 3.0;  // of the square
  Random random(7);
  double most = 0.0;
  for (int i = 0; i < 200; ++i) {
    const ElasticNoise noise(1, 300, Noise(0.0, 4.0, kAffine), random);
    for (const PlanePoint side : {PlanePoint{kSide, 0.0}, PlanePoint{0.0, kSide}}) {
      const PlanePoint moved = noise.Affine(side);
      most = std::max({most, std::abs(moved.x - side.x), std::abs(moved.y - side.y)});
    }
  }
  EXPECT_LE(most, 2.0 * kAffine);  // of two corners
  EXPECT_GT(most, 1.5 * kAffine);
}

TEST(ElasticNoiseTest, AffineMapOfSmallPicturesStaysInvertible) {
  Random random(9);
  for (int i = 0; i < 1000; ++i) {
    const ElasticNoise noise(1, 30, Noise(0.0, 4.0, 50.0), random);
    const PlanePoint x = noise.Affine({1.0, 0.0});
    const PlanePoint y = noise.Affine({0.0, 1.0});
    EXPECT_GT(x.x * y.y - x.y * y.x, 0.0);
  }
}

}  // namespace
}  // namespace color3d
