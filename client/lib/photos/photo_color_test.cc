#include "client/lib/photos/photo_color.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

#include "core/base/random.h"
#include "core/color/lab.h"

namespace color3d::client {
namespace {

constexpr int kWidth = 240, kHeight = 180;

struct Ab {
  double a = 0.0;
  double b = 0.0;
};

// A picture with detail, whose chroma is a function of the place (0..1 each way) and of L.
Image Print(const std::function<Ab(double x, double y, double l)>& chroma, double noise = 0.0) {
  Image lab(kWidth, kHeight, 3);
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 0; column < kWidth; ++column) {
      const double x = static_cast<double>(column) / kWidth;
      const double y = static_cast<double>(row) / kHeight;
      const double l = 50.0 + 25.0 * std::sin(9.0 * x + 4.0 * y) + 15.0 * std::cos(31.0 * y * x);
      const Ab ab = chroma(x, y, l);
      lab.At(0, row, column) = static_cast<float>(l);
      lab.At(1, row, column) = static_cast<float>(ab.a);
      lab.At(2, row, column) = static_cast<float>(ab.b);
    }
  }
  Image srgb = SrgbFromLab(lab);
  Random random(3);
  for (float& v : srgb.data) v += static_cast<float>(noise * (random.NextUniform() - 0.5));
  return srgb;
}

// Strongest in the middle tones, as toning is.
double Middle(double l) { return 4.0 * (l / 100.0) * (1.0 - l / 100.0); }
Ab Gray(double, double, double) { return {}; }
Ab Sepia(double, double, double l) { return {7.0 * Middle(l), 22.0 * Middle(l)}; }
Ab Cyanotype(double, double, double l) { return {-4.0 * Middle(l), -32.0 * Middle(l)}; }
Ab SplitToned(double, double, double l) {
  const double t = l / 100.0;
  return {Middle(l) * (7.0 * t - 3.0), Middle(l) * (33.0 * t - 15.0)};
}
// 1 in the middle of a spot, 0 from its edge on.
double Spot(double x, double y, double at_x, double at_y, double radius) {
  const double d = std::hypot(x - at_x, y - at_y) / radius;
  return std::max(0.0, 1.0 - d * d);
}
Ab Add(Ab tone, double much, Ab more) { return {tone.a + much * more.a, tone.b + much * more.b}; }

void ExpectSurelyMonochrome(const char* what, const Image& picture) {
  const HueSpread hues = MeasureHues(picture);
  const ColorVerdict verdict = JudgeColor(hues);
  EXPECT_FALSE(verdict.in_color) << what << ": " << hues.second_hue << ", " << hues.scatter;
  EXPECT_TRUE(verdict.is_sure) << what << ": " << hues.second_hue << ", " << hues.scatter;
  EXPECT_FALSE(HasColor(picture)) << what;
}

TEST(PhotoColor, TonedPrintsAreMonochrome) {
  ExpectSurelyMonochrome("one channel", Image(8, 8, 1, 0.5f));
  ExpectSurelyMonochrome("one pixel", Image(1, 1, 3, 0.5f));
  ExpectSurelyMonochrome("grey", Print(Gray));
  ExpectSurelyMonochrome("sepia", Print(Sepia));
  ExpectSurelyMonochrome("cyanotype", Print(Cyanotype));
  ExpectSurelyMonochrome("split-toned", Print(SplitToned));
}

TEST(PhotoColor, NoiseIsNoColor) {
  ExpectSurelyMonochrome("grey with noise", Print(Gray, 0.15));
  ExpectSurelyMonochrome("sepia with noise", Print(Sepia, 0.15));
}

TEST(PhotoColor, StainsOfSameHueAreMonochrome) {
  const auto stained = [](double x, double y, double l) {
    return Add(Sepia(x, y, l), Spot(x, y, 0.7, 0.4, 0.4), {6.0, 22.0});
  };
  const auto faded = [](double x, double y, double l) {
    const Ab tone = Sepia(x, y, l);
    return Ab{x * tone.a, x * tone.b};
  };
  EXPECT_FALSE(HasColor(Print(stained)));
  EXPECT_FALSE(HasColor(Print(faded)));
}

TEST(PhotoColor, TintsOfOtherHuesAreColorButUnsure) {
  const auto tinted = [](const std::function<Ab(double, double, double)>& tone) {
    return Print([&](double x, double y, double l) {
      Ab ab = tone(x, y, l);
      if (Spot(x, y, 0.7, 0.5, 0.2) > 0.0) ab = Add(ab, 1.0, {28.0, 4.0});     // a red dress
      if (Spot(x, y, 0.25, 0.6, 0.2) > 0.0) ab = Add(ab, 1.0, {-5.0, -28.0});  // a blue one
      return ab;
    });
  };
  for (const auto& picture : {tinted(Gray), tinted(Sepia)}) {
    const ColorVerdict verdict = JudgeColor(MeasureHues(picture));
    EXPECT_TRUE(verdict.in_color);
    EXPECT_FALSE(verdict.is_sure);
  }
}

TEST(PhotoColor, ManyHuesAreSurelyColor) {
  const Image picture = Print([](double x, double y, double) {
    return Ab{20.0 * std::sin(8.0 * y), 20.0 * std::cos(11.0 * x)};
  });
  const ColorVerdict verdict = JudgeColor(MeasureHues(picture));
  EXPECT_TRUE(verdict.in_color);
  EXPECT_TRUE(verdict.is_sure);
}

// Bananas on a grey carpet: one hue, but most of the picture has none.
TEST(PhotoColor, OneColoredObjectIsColor) {
  EXPECT_TRUE(HasColor(Print([](double x, double y, double) {
    return Spot(x, y, 0.5, 0.5, 0.25) > 0.0 ? Ab{2.0, 55.0} : Ab{0.3, 1.5};
  })));
}

}  // namespace
}  // namespace color3d::client
