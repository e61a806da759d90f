#include "core/film/returning_shots.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>

#include "core/base/random.h"
#include "core/image/codec.h"

namespace color3d {
namespace {

constexpr int kWidth = 200, kHeight = 140, kNoise = 400;

// Smooth noise; the camera shows a part of it.
class Place {
 public:
  explicit Place(uint64_t seed) : noise_(kNoise, kNoise, 1) {
    Random random(seed);
    for (float& value : noise_.data) value = static_cast<float>(random.NextUniform());
  }
  std::shared_ptr<const Image> Seen(int from) const {
    Image part(kWidth / 4 + 2, kHeight / 4 + 2, 1);
    for (int y = 0; y < part.height; ++y) {
      for (int x = 0; x < part.width; ++x) part.At(0, y, x) = 20.0f + 60.0f * noise_.At(0, y, x);
    }
    const Image large = Resize(part, part.width * 4, part.height * 4);
    auto seen = std::make_shared<Image>(kWidth - 40, kHeight, 1);
    for (int y = 0; y < seen->height; ++y) {
      for (int x = 0; x < seen->width; ++x) seen->At(0, y, x) = large.At(0, y, x + from);
    }
    return seen;
  }

 private:
  Image noise_;
};

class ReturningShotsTest : public ::testing::Test {
 protected:
  std::optional<FilmKey> Find(int frame, const std::vector<FilmKey>& keys) {
    return ReturningShots(frames_, keys, {}, pool_, cancel_).KeyAt(frame);
  }
  FilmKey KeyAt(int frame, float a) const {
    const auto luminance = frames_.luminance(frame);
    return {frame,
            {Image(luminance->width, luminance->height, 2, a),
             Image(luminance->width, luminance->height, 1, 1.0f)}};
  }
  const Place one_{1}, other_{2};
  mutable std::array<std::atomic<int>, 9> reads_{};  // of each frame
  // Shots of a place, another place, the first place again, and a flash.
  const FilmFrames frames_{{0, 0, 0, 1, 1, 2, 2, 2, 3}, [this](int frame) {
                             ++reads_[frame];
                             const bool elsewhere = frame == 3 || frame == 4;
                             return (elsewhere ? other_ : one_).Seen(4 * frame);
                           }};
  ThreadPool pool_{2};
  CancellationToken cancel_;
};

TEST_F(ReturningShotsTest, ReusesColorsOfReturningPlace) {
  const auto found = Find(6, {KeyAt(3, -30.0f), KeyAt(1, 30.0f)});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->frame, 6);
  EXPECT_GT(Coverage(found->color, 0.5f), 0.6);
  const Image& a = found->color.ab;
  EXPECT_NEAR(a.At(0, kHeight / 2, 60), 30.0f, 0.1f);
  EXPECT_EQ(found->color.confidence.At(0, kHeight / 2, a.width - 2), 0.0f)
      << "not visible in the key frame";
}

TEST_F(ReturningShotsTest, DoesNotMatchOtherPlaces) {
  EXPECT_FALSE(Find(3, {KeyAt(1, 30.0f)}));
  EXPECT_FALSE(Find(6, {KeyAt(3, 30.0f)}));
  EXPECT_FALSE(Find(6, {}));
}

TEST_F(ReturningShotsTest, ComputesFeaturesOncePerKeyFrame) {
  const std::vector<FilmKey> keys = {KeyAt(1, 30.0f)};
  reads_[1] = 0;
  const ReturningShots returning(frames_, keys, {}, pool_, cancel_);
  EXPECT_TRUE(returning.KeyAt(6));
  EXPECT_FALSE(returning.KeyAt(3));
  EXPECT_TRUE(returning.KeyAt(8));
  EXPECT_EQ(reads_[1], 1);
}

TEST(MiddlesWithoutKeyTest, ListsShotsWithoutKeyFrame) {
  const std::vector<int> shot = {0, 0, 0, 1, 1, 5, 2, 5, 5, 7};
  EXPECT_EQ(UnkeyedShotMiddles(shot, {1}), (std::vector<int>{4, 7}));
  EXPECT_EQ(UnkeyedShotMiddles(shot, {1, 8}), (std::vector<int>{4}));
  EXPECT_TRUE(UnkeyedShotMiddles(shot, {1, 3, 5}).empty());
}

}  // namespace
}  // namespace color3d
