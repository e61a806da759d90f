#include "core/metrics/quality.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/base/random.h"

namespace color3d {
namespace {

Image Noise(int width, int height, int channels, uint64_t seed, double scale = 1.0) {
  Random random(seed);
  Image image(width, height, channels);
  for (float& v : image.data) v = static_cast<float>(scale * random.NextUniform());
  return image;
}

TEST(Psnr, MatchesTheFormula) {
  Image x(3, 2, 1, 0.5f);
  Image y = x;
  EXPECT_EQ(Psnr(x, y, 1.0), 99.0);
  y.At(0, 1, 2) = 0.8f;
  EXPECT_NEAR(Psnr(x, y, 1.0), 10.0 * std::log10(1.0 / (0.09 / 6.0)), 1e-5);
  EXPECT_NEAR(Psnr(x, y, 100.0), Psnr(x, y, 1.0) + 40.0, 1e-9);
  EXPECT_NEAR(Psnr(Image(4, 4, 3, 0.0f), Image(4, 4, 3, 255.0f), 255.0), 0.0, 1e-9);
}

// The definition, term by term, with an explicit 11x11 window over zero-padded pictures.
double DirectSsim(const Image& x, const Image& y, double peak) {
  double norm = 0.0;
  for (int i = -5; i <= 5; ++i) norm += std::exp(-i * i / 4.5);
  const double c1 = 1e-4 * peak * peak;
  const double c2 = 9e-4 * peak * peak;
  double sum = 0.0;
  for (int c = 0; c < x.channels; ++c) {
    for (int v = 0; v < x.height; ++v) {
      for (int u = 0; u < x.width; ++u) {
        double mx = 0, my = 0, xx = 0, yy = 0, xy = 0;
        for (int j = -5; j <= 5; ++j) {
          for (int i = -5; i <= 5; ++i) {
            if (u + i < 0 || u + i >= x.width || v + j < 0 || v + j >= x.height) continue;
            const double w = std::exp(-(i * i + j * j) / 4.5) / (norm * norm);
            const double a = x.At(c, v + j, u + i);
            const double b = y.At(c, v + j, u + i);
            mx += w * a;
            my += w * b;
            xx += w * a * a;
            yy += w * b * b;
            xy += w * a * b;
          }
        }
        sum += (2 * mx * my + c1) * (2 * (xy - mx * my) + c2) /
               ((mx * mx + my * my + c1) * (xx - mx * mx + yy - my * my + c2));
      }
    }
  }
  return sum / static_cast<double>(x.data.size());
}

TEST(Ssim, MatchesTheDefinition) {
  for (auto [width, height] : {std::pair{24, 19}, {5, 7}, {1, 1}, {1, 30}, {40, 3}}) {
    const Image x = Noise(width, height, 3, 1, 100.0);
    const Image y = Noise(width, height, 3, 2, 80.0);
    EXPECT_NEAR(Ssim(x, y, 100.0), DirectSsim(x, y, 100.0), 1e-10) << width << " x " << height;
  }
}

TEST(Ssim, IsOneForEqualPicturesAndSymmetric) {
  const Image x = Noise(30, 20, 3, 3);
  const Image y = Noise(30, 20, 3, 4);
  EXPECT_NEAR(Ssim(x, x, 1.0), 1.0, 1e-12);
  EXPECT_NEAR(Ssim(x, y, 1.0), Ssim(y, x, 1.0), 1e-12);
  EXPECT_LT(Ssim(x, y, 1.0), 0.3);
  EXPECT_NEAR(Ssim(Image(20, 20, 1, 99.99f), Image(20, 20, 1, 99.99f), 100.0), 1.0, 1e-12);
}

TEST(AbRmse, IgnoresLightness) {
  Image x(2, 2, 3);
  Image y(2, 2, 3);
  for (int i = 0; i < 4; ++i) y.Plane(0)[i] = 50.0f;
  EXPECT_EQ(AbRmse(x, y), 0.0);
  y.At(1, 0, 0) = 6.0f;
  y.At(2, 1, 1) = -8.0f;
  EXPECT_NEAR(AbRmse(x, y), std::sqrt(100.0 / 8.0), 1e-9);
}

TEST(Quality, WrongShapesAreRefused) {
  EXPECT_THROW(Psnr(Image(2, 2, 1), Image(2, 3, 1), 1.0), Error);
  EXPECT_THROW(Psnr(Image(), Image(), 1.0), Error);
  EXPECT_THROW(Psnr(Image(2, 2, 1), Image(2, 2, 1), 0.0), Error);
  EXPECT_THROW(Ssim(Image(2, 2, 1), Image(2, 2, 3), 1.0), Error);
  EXPECT_THROW(AbRmse(Image(2, 2, 1), Image(2, 2, 1)), Error);
}

}  // namespace
}  // namespace color3d
