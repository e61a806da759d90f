#include "core/stage/film/color_frames.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <mutex>
#include <set>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/image/codec.h"
#include "core/stage/formats/artifact_io.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

constexpr int kWidth = 96, kHeight = 64, kFrames = 30;
constexpr double kPanPx = 1.2;  // from frame to frame

// A picture that moves to the left; nothing is carried into its frames.
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
        ab.At(0, y, x) = static_cast<float>(30.0 * std::sin(0.1 * (x + kPanPx * frame)));
        ab.At(1, y, x) = static_cast<float>(30.0 * std::cos(0.1 * y));
      }
    }
    return ab;
  }

  // Delivered colours by view.
  std::map<int, FusedColor> Run(int threads) {
    StageContext context({.scene_folder = scratch_.path(),
                          .inputs = inputs_,
                          .output_folder = scratch_.path() / "out",
                          .scratch_folder = scratch_.path(),
                          .threads = threads},
                         *checkpoints_,
                         observer_,
                         cancel_);
    const ViewImages images(scene_, scratch_.path(), 500, 0);
    std::mutex mutex;
    std::map<int, FusedColor> delivered;
    asked_.clear();
    guesses_ = 0;
    FrameColoring coloring;
    coloring.key_views = key_views_;
    coloring.was_done = [this](int view) { return done_.contains(view); };
    coloring.sources = [&](int view) {
      return ColorSources{
          [this, &mutex, view](const Image& l, const Image&) {
            const std::lock_guard lock(mutex);
            asked_.push_back(view);
            return InferredColor{Inferred(view), Image(l.width, l.height, 1, distance_)};
          },
          [this, &mutex](const Image& l) {
            const std::lock_guard lock(mutex);
            ++guesses_;
            return Image(l.width, l.height, 2, 5.0f);
          },
          {}};
    };
    coloring.deliver = [&](int view, const FusedColor& color) {
      const std::lock_guard lock(mutex);
      if (delivered.size() == dies_after_) throw Error(ErrorCode::kAborted, "killed");
      EXPECT_TRUE(delivered.emplace(view, color).second) << view;
    };
    try {
      ColorFrames(scene_, images, coloring, context);
      EXPECT_EQ(delivered.size() + done_.size(), scene_.views.size());
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kAborted);
      EXPECT_EQ(delivered.size(), dies_after_);
    }
    return delivered;
  }

  // Colours that the sources infer for a frame.
  Image Inferred(int view) const {
    Image ab = TrueAb(view);
    if (flicker_) {
      for (float& value : ab.data) value += view % 2 == 0 ? 8.0f : -8.0f;
    }
    return ab;
  }

  Scene scene_;
  std::vector<int> asked_;
  size_t guesses_ = 0;
  float distance_ = 0.0f;  // feature distance of the inferred pixels
  bool flicker_ = false;
  std::vector<int> key_views_;
  std::set<int> done_;
  size_t dies_after_ = 1000;  // frames
};

// A texture that moves as TrueAb does.
float Panned(int frame, int x, int y) {
  const double u = x + kPanPx * frame;
  return static_cast<float>(0.5 + 0.15 * std::sin(0.31 * u + 0.1 * y) +
                            0.15 * std::sin(0.23 * y - 0.17 * u));
}

TEST_F(ColorFramesTest, FramesBetweenTakeColorsOfAnchors) {
  AddFrames(Panned);
  const std::map<int, FusedColor> colors = Run(2);
  EXPECT_LT(asked_.size(), static_cast<size_t>(kFrames));
  for (const auto& [view, color] : colors) {
    const Image truth = TrueAb(view);
    double error = 0.0;
    for (size_t i = 0; i < truth.data.size(); ++i) {
      error += std::abs(color.ab.data[i] - truth.data[i]);
    }
    EXPECT_LT(error / static_cast<double>(truth.data.size()), 2.0) << view;
    EXPECT_NEAR(color.provenance.At(1, 30, 50), 0.0, 1e-6) << "nothing was seen: " << view;
  }
  const std::map<int, FusedColor> again = Run(1);
  for (const auto& [view, color] : colors) EXPECT_EQ(again.at(view).ab.data, color.ab.data);
}

TEST_F(ColorFramesTest, InfersStillFramesOnce) {
  AddFrames([](int, int x, int y) {
    return static_cast<float>(0.5 + 0.2 * std::sin(0.3 * x) * std::sin(0.4 * y));
  });
  distance_ = 4.0f;  // half the largest distance: half of 0.9 is guessed
  const std::map<int, FusedColor> colors = Run(2);
  EXPECT_LE(asked_.size(), 3u) << "of " << kFrames;
  for (const auto& [view, color] : colors) {
    EXPECT_NEAR(color.provenance.At(0, 30, 50), 0.45, 0.01)
        << "guessed colour stays guessed: " << view;
    EXPECT_NEAR(color.provenance.At(2, 30, 50), 0.55, 0.01) << view;
  }
}

TEST_F(ColorFramesTest, GuessesOnlyBetweenGuessedAnchors) {
  AddFrames(Panned);
  distance_ = 7.0f;  // so large that guesses count
  Run(2);
  EXPECT_EQ(guesses_, asked_.size());
  const size_t asked = asked_.size();
  distance_ = 2.0f;  // large, but a pale guess does not count
  Run(2);
  EXPECT_EQ(asked_.size(), asked);
  EXPECT_GT(guesses_, 0u) << "anchors";
  EXPECT_LT(guesses_, asked);
}

TEST_F(ColorFramesTest, SteadiesFlicker) {
  AddFrames(Panned);
  flicker_ = true;
  key_views_ = {12};
  const std::map<int, FusedColor> colors = Run(2);
  ASSERT_GT(asked_.size(), 2u);
  double jump = 0.0;
  for (int view = 1; view < kFrames; ++view) {
    if (view == 12 || view == 13) continue;  // key frames keep their colours
    jump = std::max(
        jump,
        std::abs(double{colors.at(view).ab.At(1, 30, 50)} - colors.at(view - 1).ab.At(1, 30, 50)));
  }
  EXPECT_LT(jump, 4.0) << "of 16";
}

TEST_F(ColorFramesTest, DoesNotAverageKeyFrames) {
  constexpr int kFirst = 24, kSecond = 8, kSwitch = 16;  // as near to both
  AddFrames(Panned);
  key_views_ = {kFirst, kSecond};
  for (int i = 0; i < kFrames; ++i) {
    AddInput(ViewArtifact(artifact::kCarried, scene_.views[i]),
             EncodeAbPng(Image(kWidth, kHeight, 2, i < kSwitch ? -30.0f : 30.0f)));
  }
  for (const auto& [view, color] : Run(2)) {
    const float expected = view < kSwitch ? -30.0f : 30.0f;
    for (const float value : color.ab.data) ASSERT_NEAR(value, expected, 0.5f) << view;
  }
}

TEST_F(ColorFramesTest, ResumesWithTheSameResult) {
  AddFrames(Panned);
  flicker_ = true;
  const std::map<int, FusedColor> whole = Run(2);
  for (const size_t dies_after : {1u, 9u, 20u, 29u}) {
    done_.clear();
    dies_after_ = dies_after;
    std::map<int, FusedColor> colors = Run(2);
    for (const auto& [view, color] : colors) done_.insert(view);
    dies_after_ = 1000;
    const size_t asked_before = asked_.size();
    colors.merge(Run(1));
    EXPECT_LE(asked_.size(), asked_before) << "finished frames are not computed again";
    ASSERT_EQ(colors.size(), whole.size());
    for (const auto& [view, color] : whole) {
      EXPECT_EQ(colors.at(view).ab.data, color.ab.data) << view << ", died after " << dies_after;
      EXPECT_EQ(colors.at(view).provenance.data, color.provenance.data) << view;
    }
  }
}

TEST_F(ColorFramesTest, InfersUntrackedFrames) {
  Random random(1);
  AddFrames([&](int, int, int) { return static_cast<float>(random.NextUniform()); });
  Run(2);
  EXPECT_EQ(asked_.size(), static_cast<size_t>(kFrames));
}

}  // namespace
}  // namespace color3d
