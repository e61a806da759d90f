#include "core/stage/film/color_frames.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>

#include "core/base/random.h"
#include "core/image/codec.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

constexpr int kWidth = 96, kHeight = 64, kFrames = 30;
constexpr float kGuessed = 0.25f;

// A picture that moves to the left, with nothing carried into its frames.
class ColorFramesTest : public StageTest {
 protected:
  void AddFrames(const std::function<float(int frame, int x, int y)>& luminance) {
    for (int i = 0; i < kFrames; ++i) {
      Image gray(kWidth, kHeight, 1);
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) gray.At(0, y, x) = luminance(i, x, y);
      }
      View view;
      view.name = view.image_file = "f" + std::to_string(100 + i) + ".png";
      view.camera =
          view.captured_camera = {kWidth, kHeight, 100.0, 100.0, kWidth / 2.0, kHeight / 2.0};
      view.moment = Moment{0.04 * i, 0};
      WriteFileAtomic(scratch_.path() / view.image_file, EncodePng8(gray));
      scene_.views.push_back(view);
    }
  }

  static Image TrueAb(int frame) {
    Image ab(kWidth, kHeight, 2);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        ab.At(0, y, x) = static_cast<float>(30.0 * std::sin(0.1 * (x + 1.2 * frame)));
        ab.At(1, y, x) = static_cast<float>(30.0 * std::cos(0.1 * y));
      }
    }
    return ab;
  }

  // The colours that are delivered, by view.
  std::map<int, FusedColor> Run(int threads) {
    StageContext context({.scene_folder = scratch_.path(),
                          .output_folder = scratch_.path() / "out",
                          .scratch_folder = scratch_.path(),
                          .threads = threads},
                         *checkpoints_,
                         observer_,
                         cancel_);
    const ViewImages images(scene_, scratch_.path(), 500, 0);
    std::mutex mutex;
    std::map<int, FusedColor> delivered;
    alone_.clear();
    FrameColoring coloring;
    coloring.alone = [&](int view) {
      const std::lock_guard lock(mutex);
      alone_.push_back(view);
      FusedColor color{TrueAb(view), Image(kWidth, kHeight, 3)};
      std::fill_n(color.provenance.Plane(0), kWidth * kHeight, kGuessed);
      std::fill_n(color.provenance.Plane(2), kWidth * kHeight, 1.0f - kGuessed);
      return color;
    };
    coloring.deliver = [&](int view, const FusedColor& color) {
      const std::lock_guard lock(mutex);
      EXPECT_TRUE(delivered.emplace(view, color).second) << view;
    };
    ColorFrames(scene_, images, coloring, context);
    EXPECT_EQ(delivered.size(), scene_.views.size());
    return delivered;
  }

  Scene scene_;
  std::vector<int> alone_;
};

TEST_F(ColorFramesTest, FramesBetweenTakeTheColoursOfAnchors) {
  AddFrames([](int frame, int x, int y) {
    const double u = x + 1.2 * frame;
    return static_cast<float>(0.5 + 0.15 * std::sin(0.31 * u + 0.1 * y) +
                              0.15 * std::sin(0.23 * y - 0.17 * u));
  });
  const std::map<int, FusedColor> colors = Run(2);
  EXPECT_LE(alone_.size(), 6u) << "of " << kFrames;
  double worst = 0.0;
  for (const auto& [view, color] : colors) {
    const Image truth = TrueAb(view);
    double error = 0.0;
    for (size_t i = 0; i < truth.data.size(); ++i) {
      error += std::abs(color.ab.data[i] - truth.data[i]);
    }
    worst = std::max(worst, error / static_cast<double>(truth.data.size()));
    EXPECT_NEAR(color.provenance.At(0, 30, 50), kGuessed, 0.02) << view;
    EXPECT_NEAR(color.provenance.At(1, 30, 50), 0.0, 1e-6) << "nothing was seen: " << view;
    EXPECT_NEAR(color.provenance.At(2, 30, 50), 1.0 - kGuessed, 0.02) << view;
  }
  EXPECT_LT(worst, 2.0);
  const std::map<int, FusedColor> again = Run(1);
  for (const auto& [view, color] : colors) EXPECT_EQ(again.at(view).ab.data, color.ab.data);
}

TEST_F(ColorFramesTest, WhatCannotBeFollowedIsColouredByItself) {
  Random random(1);
  AddFrames([&](int, int, int) { return static_cast<float>(random.NextUniform()); });
  Run(2);
  EXPECT_EQ(alone_.size(), static_cast<size_t>(kFrames));
}

}  // namespace
}  // namespace color3d
