#include "core/keycolor/hints/hints.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/color/lab.h"

namespace color3d {
namespace {

struct Recorder : NullObserver {
  void OnError(int64_t, const std::string& name, double value) override {
    if (name == "relative_residual") last_residual = value;
  }
  void OnWarning(const std::string& message) override { warning = message; }
  double last_residual = -1.0;
  std::string warning;
};

HintSolution Spread(const Image& luminance,
                    const std::vector<ColorHint>& hints,
                    const HintOptions& options = {},
                    const HintPictures& pictures = {},
                    Recorder* recorder = nullptr) {
  ThreadPool pool;
  NoCheckpoints none;
  Recorder own;
  const RunControl control{pool, none, recorder != nullptr ? *recorder : own, {}};
  return KeyColorFromHints(luminance, hints, options, control, pictures);
}

HintSolution SpreadStrokes(const Image& luminance,
                           const Image& strokes,
                           const HintOptions& options = {}) {
  ThreadPool pool;
  NoCheckpoints none;
  NullObserver silent;
  return KeyColorFromStrokes(luminance, strokes, options, {pool, none, silent, {}});
}

// Left half dark, right half bright, with a sharp edge between.
Image TwoHalves(int width, int height) {
  Image luminance(width, height, 1, 30.0f);
  for (int y = 0; y < height; ++y) {
    for (int x = width / 2; x < width; ++x) luminance.At(0, y, x) = 70.0f;
  }
  return luminance;
}

TEST(HintsTest, StopsColorAtLuminanceEdge) {
  const Image luminance = TwoHalves(80, 60);
  const HintSolution solution = Spread(luminance, {{10, 30, 2, 50, 20}, {70, 30, 2, -40, 10}});
  for (int y = 0; y < 60; ++y) {
    EXPECT_NEAR(solution.ab.At(0, y, 20), 50.0f, 3.0f);
    EXPECT_NEAR(solution.ab.At(0, y, 60), -40.0f, 3.0f);
    EXPECT_NEAR(solution.ab.At(1, y, 38), 20.0f, 2.0f);
    EXPECT_NEAR(solution.ab.At(1, y, 42), 10.0f, 2.0f);
  }
  EXPECT_LE(solution.relative_residual, 5e-4);
  EXPECT_GT(solution.hinted_pixels, 20);
}

TEST(HintsTest, ReportsResidual) {
  Recorder recorder;
  const HintSolution solution = Spread(TwoHalves(40, 40), {{10, 10, 2, 50, 20}}, {}, {}, &recorder);
  EXPECT_NEAR(recorder.last_residual, solution.relative_residual, 1e-5);
}

TEST(HintsTest, FillsFlatPictureFromOnlyHint) {
  const HintSolution solution = Spread(Image(64, 48, 1, 55.0f), {{5, 5, 0, 33, -12}});
  for (size_t i = 0; i < solution.ab.PlaneSize(); ++i) {
    ASSERT_NEAR(solution.ab.Plane(0)[i], 33.0f, 0.05f);
    ASSERT_NEAR(solution.ab.Plane(1)[i], -12.0f, 0.05f);
  }
}

TEST(HintsTest, KeepsOppositeHintsOnePixelApart) {
  const HintSolution solution =
      Spread(Image(33, 33, 1, 50.0f), {{16.5, 16.5, 0, 80, 80}, {17.5, 16.5, 0, -80, -80}});
  EXPECT_EQ(solution.ab.At(0, 16, 16), 80.0f);
  EXPECT_EQ(solution.ab.At(0, 16, 17), -80.0f);
  for (float value : solution.ab.data) EXPECT_LE(std::abs(value), 80.5f);
}

TEST(HintsTest, LastOfContradictingHintsWinsWithWarning) {
  const Image luminance(9, 9, 1, 50.0f);
  Recorder recorder;
  const HintSolution solution =
      Spread(luminance, {{4.5, 4.5, 0, 60, 0}, {4.5, 4.5, 0, -20, 10}}, {}, {}, &recorder);
  EXPECT_EQ(solution.ab.At(0, 4, 4), -20.0f);
  EXPECT_EQ(solution.ab.At(1, 4, 4), 10.0f);
  EXPECT_NE(recorder.warning.find("1 pixels"), std::string::npos) << recorder.warning;
  EXPECT_NE(recorder.warning.find("0 and 1"), std::string::npos) << recorder.warning;
  Recorder agreeing;
  Spread(luminance, {{4.5, 4.5, 0, 60, 0}, {4.5, 4.5, 3, 61, 0}}, {}, {}, &agreeing);
  EXPECT_EQ(agreeing.warning, "");
}

TEST(HintsTest, BlendsTwoHintsSmoothly) {
  // Along a narrow strip the interpolant is linear: no plateau, no step.
  const HintSolution solution = Spread(
      Image(101, 3, 1, 50.0f),
      {{0, 0, 0, 40, 0, ColorHint::Shape::kRegion, {}, {{0, 0}, {1, 0}, {1, 3}, {0, 3}}},
       {0, 0, 0, -40, 0, ColorHint::Shape::kRegion, {}, {{100, 0}, {101, 0}, {101, 3}, {100, 3}}}});
  for (int x = 0; x <= 100; ++x) EXPECT_NEAR(solution.ab.At(0, 1, x), 40.0f - 0.8f * x, 0.3f);
}

TEST(HintsTest, HandlesTenThousandHints) {
  Image luminance(400, 300, 1);
  Random random(4);
  for (float& value : luminance.data) value = static_cast<float>(random.NextUniform(0.0, 100.0));
  std::vector<ColorHint> hints;
  for (int k = 0; k < 10000; ++k) {
    hints.push_back({random.NextUniform(0, 400),
                     random.NextUniform(0, 300),
                     0,
                     random.NextUniform(-80, 80),
                     random.NextUniform(-80, 80)});
  }
  const HintSolution solution = Spread(luminance, hints);
  EXPECT_LE(solution.relative_residual, 5e-4);
  for (float value : solution.ab.data) ASSERT_LE(std::abs(value), 81.0f);
  const ColorHint& last = hints.back();
  EXPECT_EQ(solution.ab.At(0, static_cast<int>(last.y_px), static_cast<int>(last.x_px)),
            static_cast<float>(last.a));
}

TEST(HintsTest, StaysFiniteForExtremePictures) {
  Image checkered(64, 64, 1);
  for (int i = 0; i < 64 * 64; ++i) checkered.data[i] = (i + i / 64) % 2 ? 100.0f : 0.0f;
  for (const Image& luminance : {Image(64, 64, 1, 0.0f), Image(64, 64, 1, 100.0f), checkered}) {
    const HintSolution solution = Spread(luminance, {{20, 20, 0, 30, -30}});
    for (size_t i = 0; i < solution.ab.PlaneSize(); ++i) {
      ASSERT_NEAR(solution.ab.Plane(0)[i], 30.0f, 0.5f);
    }
  }
}

TEST(HintsTest, KeepsHintedRegionsExactly) {
  const Image luminance = TwoHalves(60, 40);
  const Image automatic(60, 40, 2, 12.5f);
  Image labels(60, 40, 1, 0.0f);
  for (int x = 0; x < 10; ++x) labels.At(0, 39, x) = 3.0f / 255.0f;
  const std::vector<ColorHint> hints = ParseHintsJson(R"([
      {"region": [[2, 2], [12, 2], [12, 12], [2, 12]], "color": "#a0522d"},
      {"region": [[40, 2], [50, 2], [50, 12], [40, 12]], "keep": "neutral"},
      {"line": [[30, 30], [50, 30]], "width": 2, "keep": "auto"},
      {"label": 3, "color": "#0000ff"}])");
  const HintSolution solution = Spread(luminance, hints, {}, {&labels, &automatic});
  EXPECT_EQ(solution.ab.At(0, 7, 7), static_cast<float>(hints[0].a));
  EXPECT_EQ(solution.ab.At(1, 2, 2), static_cast<float>(hints[0].b));
  EXPECT_NE(solution.ab.At(1, 1, 1), static_cast<float>(hints[0].b));
  EXPECT_EQ(solution.ab.At(0, 7, 45), 0.0f);
  EXPECT_EQ(solution.ab.At(0, 30, 40), 12.5f);
  EXPECT_EQ(solution.ab.At(1, 39, 9), static_cast<float>(hints[3].b));
  EXPECT_EQ(solution.hinted_pixels, 100 + 100 + 44 + 10);
}

TEST(HintsTest, NamesRefusedRegionsAndLabels) {
  const Image luminance = TwoHalves(60, 40);
  const auto message_of = [&](const char* json, const HintPictures& pictures) -> std::string {
    try {
      Spread(luminance, ParseHintsJson(json), {}, pictures);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  const Image labels(60, 40, 1), wrong(61, 40, 1);
  const char* good = R"([{"x": 1, "y": 1, "color": "#ff0000"}, )";
  const std::string first(good);
  const auto expect = [&](const std::string& entry, const HintPictures& pictures, const char* say) {
    const std::string message = message_of((first + entry + "]").c_str(), pictures);
    EXPECT_NE(message.find("hint 1"), std::string::npos) << message;
    EXPECT_NE(message.find(say), std::string::npos) << message;
  };
  expect(R"({"label": 3, "color": "#ff0000"})", {}, "no label picture");
  expect(R"({"label": 3, "color": "#ff0000"})", {&labels, nullptr}, "covers no pixel");
  expect(R"({"x": 1, "y": 1, "keep": "auto"})", {}, "automatic");
  expect(R"({"region": [[0, 0], [70, 0], [0, 9]], "color": "#ff0000"})", {}, "outside");
  expect(R"({"region": [[0, 0], [9, 0]], "color": "#ff0000"})", {}, "at least 3");
  EXPECT_NE(message_of((first + R"({"label": 0, "color": "#ff0000"}])").c_str(), {&wrong, nullptr})
                .find("61x40"),
            std::string::npos);
}

TEST(HintsTest, ReturnsHintOfWholePicture) {
  const Image luminance = TwoHalves(32, 24);
  const HintSolution solution = Spread(luminance, {{16, 12, 1e6, 12, 34}});
  EXPECT_EQ(solution.hinted_pixels, 32 * 24);
  for (size_t i = 0; i < solution.ab.PlaneSize(); ++i) {
    ASSERT_NEAR(solution.ab.Plane(0)[i], 12.0f, 1e-3f);
  }
}

TEST(HintsTest, RefusesBadHints) {
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

TEST(HintsTest, ColorsOnePixelPicture) {
  const HintSolution solution = Spread(Image(1, 1, 1, 50.0f), {{0.5, 0.5, 1, 7, 8}});
  EXPECT_NEAR(solution.ab.At(0, 0, 0), 7.0f, 1e-3f);
}

TEST(HintsTest, SolvesLargePicturesAtReducedSize) {
  const Image luminance = TwoHalves(400, 300);
  HintOptions options;
  options.max_side_px = 100;
  const HintSolution solution =
      Spread(luminance, {{50, 150, 4, 50, 0}, {350, 150, 4, -50, 0}}, options);
  ASSERT_EQ(solution.ab.width, 400);
  for (int y = 10; y < 290; y += 20) {
    EXPECT_NEAR(solution.ab.At(0, y, 196), 50.0f, 8.0f);
    EXPECT_NEAR(solution.ab.At(0, y, 203), -50.0f, 8.0f);
  }
}

TEST(StrokesTest, ReadsHintsFromAlpha) {
  const Image luminance = TwoHalves(60, 40);
  Image strokes(60, 40, 4, 0.0f);
  for (int y = 10; y < 30; ++y) {
    for (int c = 0; c < 4; ++c) strokes.At(c, y, 10) = c == 0 || c == 3 ? 1.0f : 0.0f;  // red
    for (int c = 0; c < 4; ++c) strokes.At(c, y, 50) = c == 2 || c == 3 ? 1.0f : 0.0f;  // blue
    strokes.At(1, y, 30) = 1.0f;  // green, but transparent
    strokes.At(3, y, 30) = 0.5f;
  }
  const HintSolution solution = SpreadStrokes(luminance, strokes);
  EXPECT_EQ(solution.hinted_pixels, 40);
  const LabColor red = LabFromSrgb(RgbColor{1, 0, 0});
  const LabColor blue = LabFromSrgb(RgbColor{0, 0, 1});
  EXPECT_NEAR(solution.ab.At(0, 5, 20), red.a, 4.0);
  EXPECT_NEAR(solution.ab.At(1, 5, 40), blue.b, 6.0);
}

TEST(StrokesTest, ReadsHintsFromChromaWithoutAlpha) {
  const Image luminance(40, 40, 1, 50.0f);
  Image strokes(40, 40, 3, 0.5f);
  strokes.At(0, 20, 20) = 0.9f;
  const HintSolution solution = SpreadStrokes(luminance, strokes);
  EXPECT_EQ(solution.hinted_pixels, 1);
  EXPECT_GT(solution.ab.At(0, 2, 2), 20.0f);
}

TEST(StrokesTest, KeepsThinStrokesWhenReduced) {
  const Image luminance(600, 600, 1, 50.0f);
  Image strokes(600, 600, 4, 0.0f);
  for (int c : {0, 3}) strokes.At(c, 300, 300) = 1.0f;
  HintOptions options;
  options.max_side_px = 64;
  const HintSolution solution = SpreadStrokes(luminance, strokes, options);
  EXPECT_NEAR(solution.ab.At(0, 10, 10), LabFromSrgb(RgbColor{1, 0, 0}).a, 2.0);
}

TEST(StrokesTest, RefusesMissingStrokesAndOtherSizes) {
  const Image luminance(40, 40, 1, 50.0f);
  EXPECT_THROW(SpreadStrokes(luminance, Image(40, 40, 4, 0.0f)), Error);
  EXPECT_THROW(SpreadStrokes(luminance, Image(40, 40, 3, 0.7f)), Error);
  EXPECT_THROW(SpreadStrokes(luminance, Image(40, 41, 4, 1.0f)), Error);
  EXPECT_THROW(SpreadStrokes(luminance, Image(40, 40, 1, 1.0f)), Error);
}

}  // namespace
}  // namespace color3d
