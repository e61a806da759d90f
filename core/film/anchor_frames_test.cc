#include "core/film/anchor_frames.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr int kWidth = 160, kHeight = 96;

// A texture that moves by `step_px` to the left from frame to frame.
std::vector<int> AnchorsOf(double step_px, std::vector<int> shots, const AnchorOptions& options) {
  FilmFrames frames{std::move(shots), [&](int frame) {
                      auto image = std::make_shared<Image>(kWidth, kHeight, 1);
                      for (int y = 0; y < kHeight; ++y) {
                        for (int x = 0; x < kWidth; ++x) {
                          const double u = x + step_px * frame;
                          image->At(0, y, x) =
                              static_cast<float>(50.0 + 15.0 * std::sin(0.31 * u) +
                                                 15.0 * std::sin(0.17 * u + 0.4 * y));
                        }
                      }
                      return image;
                    }};
  ThreadPool pool(2);
  CancellationToken cancel;
  return AnchorFrames(frames, options, pool, cancel);
}

TEST(AnchorFramesTest, NeedsFewAnchorsWithoutMotion) {
  EXPECT_EQ(AnchorsOf(0.0, std::vector<int>(24, 0), {.most_frames = 12}),
            (std::vector<int>{5, 17}));
  EXPECT_EQ(AnchorsOf(0.0, {0}, {}), (std::vector<int>{0}));
  EXPECT_TRUE(AnchorsOf(0.0, {}, {}).empty());
}

TEST(AnchorFramesTest, NumberIsIndependentOfFrameRate) {
  // 4 and 2 px a frame of 160.
  const AnchorOptions options{.most_motion = 0.1, .most_frames = 100};
  const size_t slow = AnchorsOf(4.0, std::vector<int>(40, 0), options).size();
  const size_t fast = AnchorsOf(2.0, std::vector<int>(80, 0), options).size();
  EXPECT_GE(slow, 7u);
  EXPECT_LE(slow, 12u);
  EXPECT_NEAR(static_cast<double>(fast), static_cast<double>(slow), 1.0);
}

TEST(AnchorFramesTest, GivesEachShotAnchors) {
  EXPECT_EQ(AnchorsOf(0.0, {0, 0, 0, 1, 1, 1, 2}, {}), (std::vector<int>{1, 4, 6}));
  // Frames of several cameras alternate.
  EXPECT_EQ(AnchorsOf(0.0, {0, 1, 0, 1, 0, 1}, {}), (std::vector<int>{2, 3}));
}

TEST(AnchorFramesTest, ZeroMotionMakesEachFrameAnAnchor) {
  EXPECT_EQ(AnchorsOf(2.0, {0, 0, 0}, {.most_motion = 0.0}), (std::vector<int>{0, 1, 2}));
  EXPECT_THROW(AnchorsOf(0.0, {0}, {.most_frames = 0}), Error);
}

}  // namespace
}  // namespace color3d
