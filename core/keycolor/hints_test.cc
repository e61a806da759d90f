#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/keycolor/keycolor.h"

namespace color3d {
namespace {

struct Recorder : NullObserver {
  void OnError(int64_t, const std::string& name, double value) override {
    if (name == "relative_residual") last_residual = value;
  }
  double last_residual = -1.0;
};

HintSolution Spread(const Image& luminance,
                    const std::vector<ColorHint>& hints,
                    HintOptions options = {}) {
  Recorder recorder;
  return KeyColorFromHints(luminance, hints, options, recorder, {});
}

// Left half dark, right half bright, with a sharp edge between.
Image TwoHalves(int width, int height) {
  Image luminance(width, height, 1, 30.0f);
  for (int y = 0; y < height; ++y) {
    for (int x = width / 2; x < width; ++x) luminance.At(0, y, x) = 70.0f;
  }
  return luminance;
}

TEST(HintsTest, ColourStopsAtALuminanceEdge) {
  const Image luminance = TwoHalves(80, 60);
  const HintSolution solution = Spread(luminance, {{10, 30, 2, 50, 20}, {70, 30, 2, -40, 10}});
  for (int y = 0; y < 60; ++y) {
    EXPECT_NEAR(solution.ab.At(0, y, 20), 50.0f, 3.0f);
    EXPECT_NEAR(solution.ab.At(0, y, 60), -40.0f, 3.0f);
    EXPECT_NEAR(solution.ab.At(1, y, 38), 20.0f, 2.0f);
    EXPECT_NEAR(solution.ab.At(1, y, 42), 10.0f, 2.0f);
  }
  EXPECT_LE(solution.relative_residual, 1e-6);
  EXPECT_GT(solution.hinted_pixels, 20);
}

TEST(HintsTest, ReportsTheResidual) {
  Recorder recorder;
  const HintSolution solution =
      KeyColorFromHints(TwoHalves(40, 40), {{10, 10, 2, 50, 20}}, {}, recorder, {});
  EXPECT_EQ(recorder.last_residual, solution.relative_residual);
}

TEST(HintsTest, FlatPictureTakesItsOnlyHint) {
  const HintSolution solution = Spread(Image(64, 48, 1, 55.0f), {{5, 5, 0, 33, -12}});
  for (size_t i = 0; i < solution.ab.PlaneSize(); ++i) {
    ASSERT_NEAR(solution.ab.Plane(0)[i], 33.0f, 0.05f);
    ASSERT_NEAR(solution.ab.Plane(1)[i], -12.0f, 0.05f);
  }
}

TEST(HintsTest, OppositeHintsOnePixelApartBothHold) {
  const HintSolution solution =
      Spread(Image(33, 33, 1, 50.0f), {{16.5, 16.5, 0, 80, 80}, {17.5, 16.5, 0, -80, -80}});
  EXPECT_NEAR(solution.ab.At(0, 16, 16), 80.0f, 1.5f);
  EXPECT_NEAR(solution.ab.At(0, 16, 17), -80.0f, 1.5f);
  for (float value : solution.ab.data) EXPECT_LE(std::abs(value), 80.5f);
}

TEST(HintsTest, HintsOnTheSamePixelAreAveraged) {
  const HintSolution solution =
      Spread(Image(9, 9, 1, 50.0f), {{4.5, 4.5, 0, 60, 0}, {4.5, 4.5, 0, -20, 10}});
  EXPECT_NEAR(solution.ab.At(0, 4, 4), 20.0f, 0.1f);
  EXPECT_NEAR(solution.ab.At(1, 4, 4), 5.0f, 0.1f);
}

TEST(HintsTest, AHintThatCoversEverythingIsTheAnswer) {
  const Image luminance = TwoHalves(32, 24);
  const HintSolution solution = Spread(luminance, {{16, 12, 1e6, 12, 34}});
  EXPECT_EQ(solution.hinted_pixels, 32 * 24);
  for (size_t i = 0; i < solution.ab.PlaneSize(); ++i) {
    ASSERT_NEAR(solution.ab.Plane(0)[i], 12.0f, 1e-3f);
  }
}

TEST(HintsTest, BadHintsAreRefused) {
  const Image luminance(32, 24, 1, 50.0f);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<ColorHint> bad{{32, 5, 1, 0, 0},
                                   {-0.1, 5, 1, 0, 0},
                                   {5, 24, 1, 0, 0},
                                   {5, 5, -1, 0, 0},
                                   {nan, 5, 1, 0, 0},
                                   {5, 5, 1, 200, 0},
                                   {5, 5, nan, 0, 0}};
  for (const ColorHint& hint : bad) EXPECT_THROW(Spread(luminance, {hint}), Error);
  EXPECT_THROW(Spread(luminance, {}), Error);
  EXPECT_THROW(Spread(Image(4, 4, 2), {{1, 1, 1, 0, 0}}), Error);
  HintOptions options;
  options.sigma = 0.0;
  EXPECT_THROW(Spread(luminance, {{5, 5, 1, 0, 0}}, options), Error);
  Image broken = luminance;
  broken.data[7] = std::numeric_limits<float>::infinity();
  EXPECT_THROW(Spread(broken, {{5, 5, 1, 0, 0}}), Error);
}

TEST(HintsTest, OnePixelPicture) {
  const HintSolution solution = Spread(Image(1, 1, 1, 50.0f), {{0.5, 0.5, 1, 7, 8}});
  EXPECT_NEAR(solution.ab.At(0, 0, 0), 7.0f, 1e-3f);
}

TEST(HintsTest, LargePicturesAreSolvedSmallAndFollowTheEdgesOfTheLargeOne) {
  const Image luminance = TwoHalves(400, 300);
  HintOptions options;
  options.max_side_px = 100;
  const HintSolution solution =
      Spread(luminance, {{50, 150, 4, 50, 0}, {350, 150, 4, -50, 0}}, options);
  ASSERT_EQ(solution.ab.width, 400);
  for (int y = 10; y < 290; y += 20) {
    EXPECT_NEAR(solution.ab.At(0, y, 196), 50.0f, 5.0f);
    EXPECT_NEAR(solution.ab.At(0, y, 203), -50.0f, 5.0f);
  }
}

TEST(StrokesTest, AlphaMarksTheHints) {
  const Image luminance = TwoHalves(60, 40);
  Image strokes(60, 40, 4, 0.0f);
  for (int y = 10; y < 30; ++y) {
    for (int c = 0; c < 4; ++c) strokes.At(c, y, 10) = c == 0 || c == 3 ? 1.0f : 0.0f;  // red
    for (int c = 0; c < 4; ++c) strokes.At(c, y, 50) = c == 2 || c == 3 ? 1.0f : 0.0f;  // blue
    strokes.At(1, y, 30) = 1.0f;  // green, but transparent
    strokes.At(3, y, 30) = 0.5f;
  }
  Recorder recorder;
  const HintSolution solution = KeyColorFromStrokes(luminance, strokes, {}, recorder, {});
  EXPECT_EQ(solution.hinted_pixels, 40);
  const LabColor red = LabFromSrgb(RgbColor{1, 0, 0});
  const LabColor blue = LabFromSrgb(RgbColor{0, 0, 1});
  EXPECT_NEAR(solution.ab.At(0, 5, 20), red.a, 4.0);
  EXPECT_NEAR(solution.ab.At(1, 5, 40), blue.b, 6.0);
}

TEST(StrokesTest, ChromaMarksTheHintsWithoutAlpha) {
  const Image luminance(40, 40, 1, 50.0f);
  Image strokes(40, 40, 3, 0.5f);
  strokes.At(0, 20, 20) = 0.9f;
  Recorder recorder;
  const HintSolution solution = KeyColorFromStrokes(luminance, strokes, {}, recorder, {});
  EXPECT_EQ(solution.hinted_pixels, 1);
  EXPECT_GT(solution.ab.At(0, 2, 2), 20.0f);
}

TEST(StrokesTest, ThinStrokesSurviveTheReduction) {
  const Image luminance(600, 600, 1, 50.0f);
  Image strokes(600, 600, 4, 0.0f);
  for (int c : {0, 3}) strokes.At(c, 300, 300) = 1.0f;
  HintOptions options;
  options.max_side_px = 64;
  Recorder recorder;
  const HintSolution solution = KeyColorFromStrokes(luminance, strokes, options, recorder, {});
  EXPECT_NEAR(solution.ab.At(0, 10, 10), LabFromSrgb(RgbColor{1, 0, 0}).a, 2.0);
}

TEST(StrokesTest, NoStrokeOrAnotherSizeIsRefused) {
  const Image luminance(40, 40, 1, 50.0f);
  Recorder recorder;
  EXPECT_THROW(KeyColorFromStrokes(luminance, Image(40, 40, 4, 0.0f), {}, recorder, {}), Error);
  EXPECT_THROW(KeyColorFromStrokes(luminance, Image(40, 40, 3, 0.7f), {}, recorder, {}), Error);
  EXPECT_THROW(KeyColorFromStrokes(luminance, Image(40, 41, 4, 1.0f), {}, recorder, {}), Error);
  EXPECT_THROW(KeyColorFromStrokes(luminance, Image(40, 40, 1, 1.0f), {}, recorder, {}), Error);
}

}  // namespace
}  // namespace color3d
