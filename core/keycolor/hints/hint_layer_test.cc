#include "core/keycolor/hints/hint_layer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/base/random.h"

namespace color3d {
namespace {

HintLayer LayerOf(const Image& luminance,
                  const Image& below,
                  const std::vector<ColorHint>& hints,
                  const LayerOptions& options = {},
                  int threads = 2) {
  ThreadPool pool(threads);
  NoCheckpoints none;
  NullObserver silent;
  return LayerOfHints(luminance, below, hints, options, {pool, none, silent, {}});
}

ColorHint Stroke(double x0, double y0, double x1, double y1, double a, double b) {
  ColorHint hint{0, 0, 3, a, b};
  hint.shape = ColorHint::Shape::kLine;
  hint.points_px = {{x0, y0}, {x1, y1}};
  return hint;
}

// Flat, with a brighter square from 60 to 140 px and grain of 1 L.
Image SquareOnGround(int width = 400, int height = 300) {
  Image luminance(width, height, 1, 40.0f);
  Random random(7);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const bool inside = x >= 60 && x < 140 && y >= 60 && y < 140;
      luminance.At(0, y, x) = (inside ? 65.0f : 40.0f) + static_cast<float>(random.NextUniform());
    }
  }
  return luminance;
}

Image Green(const Image& luminance) {
  Image below(luminance.width, luminance.height, 2, 20.0f);
  std::fill_n(below.Plane(0), below.PlaneSize(), -20.0f);
  return below;
}

TEST(HintLayerTest, StrokeFillsItsThingAndLeavesTheRestAlone) {
  const Image luminance = SquareOnGround();
  Image colors = Green(luminance);
  const HintLayer layer = LayerOf(luminance, colors, {Stroke(80, 100, 120, 100, 50, 10)});
  EXPECT_GT(layer.hinted_pixels, 100);
  LayAbove(layer, &colors);
  for (const int y : {68, 100, 132}) {
    for (const int x : {68, 100, 132}) {
      EXPECT_NEAR(colors.At(0, y, x), 50.0f, 2.0f) << x << " " << y;
      EXPECT_NEAR(colors.At(1, y, x), 10.0f, 2.0f) << x << " " << y;
    }
  }
  for (const int y : {20, 50, 150, 280}) {
    for (const int x : {20, 50, 150, 300}) {
      EXPECT_NEAR(colors.At(0, y, x), -20.0f, 1.0f) << x << " " << y;
    }
  }
  EXPECT_EQ(layer.share.At(0, 280, 390), 0.0f) << "far away the colours below stay exactly";
  EXPECT_EQ(colors.At(0, 280, 390), -20.0f);
}

TEST(HintLayerTest, PullFadesWithTheDistanceOnOneThing) {
  const Image luminance(600, 100, 1, 50.0f);
  const HintLayer layer = LayerOf(luminance, Green(luminance), {Stroke(5, 5, 5, 95, 50, 10)});
  EXPECT_GT(layer.share.At(0, 50, 20), 0.99f);
  float before = 1.0f;
  for (int x = 20; x < 600; x += 20) {
    EXPECT_LE(layer.share.At(0, 50, x), before + 1e-3f) << x;
    before = layer.share.At(0, 50, x);
  }
  EXPECT_EQ(before, 0.0f);
  EXPECT_NEAR(layer.ab.At(0, 50, 60), 50.0f, 0.5f) << "weak colours are still those of the stroke";
}

// A slow ramp has no edge, but its end is unlike its beginning.
TEST(HintLayerTest, PlacesThatAreUnlikeResist) {
  Image flat(300, 60, 1, 50.0f), ramp = flat;
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 300; ++x) ramp.At(0, y, x) = 30.0f + 0.2f * static_cast<float>(x);
  }
  const std::vector<ColorHint> hints = {Stroke(10, 5, 10, 55, 50, 10)};
  EXPECT_LT(LayerOf(ramp, Green(ramp), hints).share.At(0, 30, 60),
            LayerOf(flat, Green(flat), hints).share.At(0, 30, 60) - 0.1f);
  Image two_colors = Green(flat);
  for (int y = 0; y < 60; ++y) {
    for (int x = 30; x < 300; ++x) two_colors.At(0, y, x) = 40.0f;
  }
  EXPECT_LT(LayerOf(flat, two_colors, hints).share.At(0, 30, 60),
            LayerOf(flat, Green(flat), hints).share.At(0, 30, 60) - 0.1f);
}

TEST(HintLayerTest, HintedPixelsAreExactAndKeptOnesStay) {
  const Image luminance = SquareOnGround();
  ColorHint kept = Stroke(80, 120, 120, 120, 0, 0);
  kept.fill = ColorHint::Fill::kAutomatic;
  Image colors = Green(luminance);
  const HintLayer layer = LayerOf(luminance, colors, {Stroke(80, 80, 120, 80, 50, 10), kept});
  LayAbove(layer, &colors);
  EXPECT_EQ(colors.At(0, 80, 100), 50.0f);
  EXPECT_EQ(colors.At(1, 80, 100), 10.0f);
  EXPECT_EQ(colors.At(0, 120, 100), -20.0f);
  EXPECT_LT(layer.share.At(0, 126, 100), 0.9f) << "what is kept holds its neighbourhood";
}

TEST(HintLayerTest, FarStrokesDoNotChangeEachOther) {
  const Image luminance = SquareOnGround();
  const ColorHint here = Stroke(80, 100, 120, 100, 50, 10);
  const HintLayer alone = LayerOf(luminance, Green(luminance), {here});
  const HintLayer both =
      LayerOf(luminance, Green(luminance), {here, Stroke(350, 200, 390, 290, -30, -30)});
  for (int y = 50; y < 150; y += 5) {
    for (int x = 50; x < 150; x += 5) {
      EXPECT_NEAR(alone.share.At(0, y, x), both.share.At(0, y, x), 0.1f) << x << " " << y;
    }
  }
}

TEST(HintLayerTest, LargePhotosAreSolvedSmallerAndAgree) {
  const Image luminance = SquareOnGround();
  const std::vector<ColorHint> hints = {Stroke(80, 100, 120, 100, 50, 10)};
  LayerOptions options;
  const HintLayer whole = LayerOf(luminance, Green(luminance), hints, options);
  options.max_side_px = 200;
  const HintLayer small = LayerOf(luminance, Green(luminance), hints, options);
  double difference = 0.0;
  for (size_t i = 0; i < whole.share.data.size(); ++i) {
    difference += std::abs(whole.share.data[i] - small.share.data[i]);
  }
  EXPECT_LT(difference / static_cast<double>(whole.share.data.size()), 0.02);
  EXPECT_EQ(small.share.At(0, 100, 100), 1.0f);
  EXPECT_EQ(small.ab.At(0, 100, 100), 50.0f);
}

TEST(HintLayerTest, ResultDoesNotDependOnThreads) {
  const Image luminance = SquareOnGround();
  const std::vector<ColorHint> hints = {Stroke(80, 100, 120, 100, 50, 10)};
  const HintLayer one = LayerOf(luminance, Green(luminance), hints, {}, 1);
  const HintLayer three = LayerOf(luminance, Green(luminance), hints, {}, 3);
  EXPECT_EQ(one.share.data, three.share.data);
  EXPECT_EQ(one.ab.data, three.ab.data);
}

TEST(HintLayerTest, RefusesWhatHintsRefuse) {
  const Image luminance = SquareOnGround();
  EXPECT_THROW(LayerOf(luminance, Green(luminance), {}), Error);
  EXPECT_THROW(LayerOf(luminance, Green(luminance), {Stroke(80, 100, 500, 100, 50, 10)}), Error);
  EXPECT_THROW(LayerOf(luminance, Green(Image(9, 9, 1)), {Stroke(80, 100, 90, 100, 50, 10)}),
               Error);
}

TEST(ScaleHintsTest, KeepsSmallHintsVisible) {
  ColorHint region{0, 0, 2, 50, 10};
  region.shape = ColorHint::Shape::kRegion;
  region.points_px = {{100, 100}, {101, 100}, {100, 101}};
  const auto scaled = ScaleHints({{40, 20, 2, 50, 10}, region}, 0.1, 0.1);
  EXPECT_DOUBLE_EQ(scaled[0].x_px, 4.0);
  EXPECT_DOUBLE_EQ(scaled[0].radius_px, 0.75);
  EXPECT_DOUBLE_EQ(scaled[1].points_px[1][0], 10.1);
  ThreadPool pool(1);
  NoCheckpoints none;
  NullObserver silent;
  HintPictures pictures;
  const Image luminance(40, 30, 1, 50.0f);
  EXPECT_THROW(KeyColorFromHints(luminance, {scaled[1]}, {}, {pool, none, silent, {}}, pictures),
               Error);
  pictures.is_reduced = true;
  EXPECT_NEAR(
      KeyColorFromHints(luminance, {scaled[1]}, {}, {pool, none, silent, {}}, pictures).ab.data[0],
      50.0f,
      0.1f);
}

}  // namespace
}  // namespace color3d
