#include "core/keyview/frame_content.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/base/random.h"

namespace color3d {
namespace {

// Resembles a photograph: waves of many lengths, with phases by `seed`.
Image Scenery(uint64_t seed, int width = 384, int height = 288) {
  Random random(seed);
  Image image(width, height, 1, 50.0f);
  for (int wave = 0; wave < 30; ++wave) {
    const double length = 6.0 * std::pow(1.12, wave);
    const double angle = random.NextUniform(0, 6.28);
    const double phase = random.NextUniform(0, 6.28);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double along = x * std::cos(angle) + y * std::sin(angle);
        image.At(0, y, x) +=
            static_cast<float>(0.17 * std::sqrt(length) * std::sin(6.28 * along / length + phase));
      }
    }
  }
  return image;
}

Image Blurred(const Image& image, int radius) {
  Image result = image;
  for (int pass = 0; pass < 4; ++pass) {
    const Image before = result;
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        float sum = 0.0f;
        for (int k = -radius; k <= radius; ++k) {
          const int yy = std::clamp(pass % 2 ? y + k : y, 0, image.height - 1);
          const int xx = std::clamp(pass % 2 ? x : x + k, 0, image.width - 1);
          sum += before.At(0, yy, xx);
        }
        result.At(0, y, x) = sum / static_cast<float>(2 * radius + 1);
      }
    }
  }
  return result;
}

Image Noise(float mean, float deviation, uint64_t seed) {
  Random random(seed);
  Image image(384, 288, 1);
  for (float& value : image.data)
    value = mean + deviation * static_cast<float>(random.NextNormal());
  return image;
}

std::vector<FrameContent> SceneryFrames(int count) {
  static const std::vector<FrameContent> all = [] {
    std::vector<FrameContent> frames;
    for (int i = 0; i < 7; ++i) frames.push_back(MeasureFrameContent(Scenery(10 + i)));
    return frames;
  }();
  return {all.begin(), all.begin() + count};
}

std::string ReasonFor(const Image& image, int others) {
  std::vector<FrameContent> frames = SceneryFrames(others);
  frames.push_back(MeasureFrameContent(image));
  return UnfitFrames(frames).back();
}

TEST(UnfitFramesTest, NamesEachDefect) {
  Image half = Scenery(3);
  for (int y = 0; y < half.height; ++y) {
    for (int x = 0; x < half.width / 2; ++x) half.At(0, y, x) = 0.0f;
  }
  for (int others : {2, 7}) {
    EXPECT_EQ(ReasonFor(Image(384, 288, 1, 0.0f), others), "blank");
    EXPECT_EQ(ReasonFor(Image(384, 288, 1, 100.0f), others), "blank");
    EXPECT_EQ(ReasonFor(Noise(3.0f, 0.7f, 1), others), "blank") << "a covered lens";
    EXPECT_EQ(ReasonFor(Noise(50.0f, 15.0f, 1), others), "noise");
    EXPECT_EQ(ReasonFor(half, others), "much of it is empty");
    EXPECT_NE(ReasonFor(Blurred(Scenery(3), 6), others), "");
    EXPECT_EQ(ReasonFor(Scenery(3), others), "");
    EXPECT_EQ(ReasonFor(Scenery(3, 288, 384), others), "") << "upright";
  }
}

TEST(UnfitFramesTest, ComparesFramesWithinShot) {
  const FrameContent rich{20.0, 4.0, 0.8, 0.95}, plain{12.0, 2.5, 0.45, 0.97};
  const FrameContent blurred{12.0, 0.7, 0.45, 0.99}, title{25.0, 1.5, 0.15, 0.9};
  const FrameContent blank{0.5, 0.1, 0.0, 0.99};
  std::vector<FrameContent> frames(9, rich);
  frames.insert(frames.end(), {plain, plain, plain, blurred, title, title, blank, blank});
  std::vector<int> shots(9, 0);
  shots.insert(shots.end(), {1, 1, 1, 1, 2, 2, 3, 3});
  const std::vector<std::string> unfit = UnfitFrames(frames, shots);
  for (int i = 0; i < 12; ++i) EXPECT_EQ(unfit[i], "") << i;
  EXPECT_EQ(unfit[12], "blurred");
  EXPECT_EQ(unfit[13], "much of it is empty");
  EXPECT_EQ(unfit[15], "blank");
  EXPECT_EQ(UnfitFrames(frames)[9], "much of it is empty")
      << "compared with all frames as one shot";
}

TEST(UnfitFramesTest, KeepsAllFramesWhenAllAreUnfit) {
  const FrameContent blank = MeasureFrameContent(Image(40, 30, 1));
  EXPECT_EQ(UnfitFrames({blank, blank, blank}), std::vector<std::string>(3));
  const FrameContent noise = MeasureFrameContent(Noise(50.0f, 15.0f, 2));
  EXPECT_EQ(UnfitFrames({noise, noise, noise}), std::vector<std::string>(3));
  EXPECT_TRUE(UnfitFrames({}).empty());
}

TEST(FrameContentTest, AcceptsTinyAndNonFinitePictures) {
  for (int size : {1, 2, 7}) {
    const FrameContent content = MeasureFrameContent(Image(size, 1, 1, 5.0f));
    EXPECT_TRUE(std::isfinite(content.detail + content.structure + content.correlation));
  }
  Image broken(20, 20, 1, 10.0f);
  broken.data[7] = std::numeric_limits<float>::quiet_NaN();
  broken.data[9] = std::numeric_limits<float>::infinity();
  EXPECT_TRUE(std::isfinite(MeasureFrameContent(broken).deviation));
  EXPECT_THROW(MeasureFrameContent(Image()), Error);
  EXPECT_THROW(MeasureFrameContent(Image(4, 4, 3)), Error);
}

}  // namespace
}  // namespace color3d
