#include "core/color/relative_chroma.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/random.h"

namespace color3d {
namespace {

// One hue under light that varies within every window.
struct Shaded {
  Image luminance{96, 64, 1};
  Image ab{96, 64, 2};

  explicit Shaded(double power, double noise = 0.0) {
    Random random(3);
    const RelativeChroma relative{power};
    for (size_t i = 0; i < luminance.data.size(); ++i) {
      luminance.data[i] = static_cast<float>(random.NextUniform(5.0, 95.0));
      const float scale = relative.Scale(luminance.data[i]);
      ab.Plane(0)[i] = 30.0f * scale + static_cast<float>(noise * random.NextNormal());
      ab.Plane(1)[i] = -20.0f * scale + static_cast<float>(noise * random.NextNormal());
    }
  }
};

TEST(RelativeChromaTest, FindsExponentOfPicture) {
  for (double power : {0.0, 0.3, 0.6, 1.0}) {
    const Shaded picture(power, /*noise=*/0.5);
    EXPECT_NEAR(FitRelativeChroma(picture.luminance, picture.ab).power, power, 0.03) << power;
  }
}

TEST(RelativeChromaTest, GrayOrFlatPictureHasNoEstimate) {
  EXPECT_NEAR(FitRelativeChroma(Image(40, 40, 1, 50.0f), Image(40, 40, 2, 20.0f)).power, 0.5, 1e-6);
  const Shaded picture(0.6);
  EXPECT_EQ(FitRelativeChroma(picture.luminance, Image(96, 64, 2)).power, 0.5);
}

TEST(RelativeChromaTest, RoundTrips) {
  const Shaded picture(0.7, /*noise=*/3.0);
  const RelativeChroma relative{0.7};
  const Image there = ToRelative(relative, picture.luminance, picture.ab);
  const Image back = FromRelative(relative, picture.luminance, there);
  for (size_t i = 0; i < back.data.size(); ++i) {
    EXPECT_NEAR(back.data[i], picture.ab.data[i], 1e-4);
    EXPECT_TRUE(std::isfinite(there.data[i]));
  }
  EXPECT_EQ(ToRelative({0.0}, picture.luminance, picture.ab).data, picture.ab.data);
}

TEST(RelativeChromaTest, ClampsLuminance) {
  const RelativeChroma relative{1.0};
  EXPECT_FLOAT_EQ(relative.Scale(50.0f), 1.0f);
  EXPECT_EQ(relative.Scale(-30.0f), relative.Scale(0.0f));
  EXPECT_EQ(relative.Scale(130.0f), relative.Scale(100.0f));
  EXPECT_GT(relative.Scale(0.0f), 0.0f);
}

}  // namespace
}  // namespace color3d
