#include "tests/bench/pretrain/photo_set.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/image/codec.h"

namespace color3d {
namespace {

// Picture with colours that encode the position: red to the right, green downwards.
Image Ramps(int width, int height, float blue) {
  Image photo(width, height, 3, blue);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      photo.At(0, y, x) = static_cast<float>(x) / static_cast<float>(width);
      photo.At(1, y, x) = static_cast<float>(y) / static_cast<float>(height);
    }
  }
  return photo;
}

class PhotoSetTest : public testing::Test {
 protected:
  PhotoSetTest() {
    folder_ = std::filesystem::path(testing::TempDir()) /
              testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::remove_all(folder_);
  }
  ~PhotoSetTest() override { std::filesystem::remove_all(folder_); }
  void Write(const std::string& name, const Image& image) {
    std::filesystem::create_directories((folder_ / name).parent_path());
    WriteFileAtomic(folder_ / name, EncodePng8(image));
  }

  std::filesystem::path folder_;
};

TEST_F(PhotoSetTest, MatchesOfPairShowSamePlace) {
  Write("photo.png", Ramps(200, 150, 0.2f));
  const PhotoSet photos({{folder_, 1.0}});
  Random random(4);
  int known = 0;
  int mirrored = 0;
  for (int i = 0; i < 20; ++i) {
    const TrainingPair pair = photos.Pair(64, random);
    ASSERT_EQ(pair.matches.width, 16);
    for (int y = 0; y < 16; ++y) {
      for (int x = 0; x < 16; ++x) {
        const float u = pair.matches.At(0, y, x), v = pair.matches.At(1, y, x);
        if (u < 0.0f) continue;
        ASSERT_LT(std::max(u, v), 64.0f);
        if (std::min(u, v) < 1.0f || std::max(u, v) > 63.0f) continue;
        ++known;
        const int px = static_cast<int>(u), py = static_cast<int>(v);
        for (int c = 0; c < 2; ++c) {
          // A pixel of `first` spans up to 1/64, one of `second` too.
          ASSERT_NEAR(
              pair.second.srgb.At(c, 4 * y + 2, 4 * x + 2), pair.first.srgb.At(c, py, px), 0.035f);
        }
      }
    }
    const auto to_the_right = [](const Image& srgb) {
      return srgb.At(0, 32, 60) > srgb.At(0, 32, 4);
    };
    mirrored += to_the_right(pair.first.srgb) != to_the_right(pair.second.srgb) ? 1 : 0;
  }
  EXPECT_GT(known, 1000);
  EXPECT_LT(mirrored, 10);  // mirror images are one of seven
}

TEST_F(PhotoSetTest, PairsFramesOfClips) {
  for (int i = 0; i < 3; ++i) {
    Write("clips/one/" + std::to_string(i) + ".png", Ramps(60, 60, 0.3f * static_cast<float>(i)));
  }
  Write("photos/a.png", Ramps(80, 60, 0.5f));
  const PhotoSet photos({{folder_ / "photos", 1.0}}, {{folder_ / "clips", 3.0}});
  EXPECT_EQ(photos.size(), 4u);
  Random random(2);
  int unknown = 0;
  int across = 0;
  for (int i = 0; i < 80; ++i) {
    const TrainingPair pair = photos.Pair(32, random);
    const float blue = pair.first.srgb.At(2, 16, 16) - pair.second.srgb.At(2, 16, 16);
    bool known = false;
    for (float v : pair.matches.data) known = known || v >= 0.0f;
    if (std::abs(blue) > 0.1f) {
      ++across;
      EXPECT_FALSE(known);
    }
    unknown += known ? 0 : 1;
  }
  // Three of four pairs are from the clip, and two of three of these from different frames.
  EXPECT_GT(across, 20);
  EXPECT_LT(unknown, 70);
}

TEST_F(PhotoSetTest, CropsStayInsideAndKeepColor) {
  Write("photo.png", Ramps(90, 50, 0.2f));
  const PhotoSet photos({{folder_, 1.0}});
  Random random(5);
  for (int i = 0; i < 20; ++i) {
    const TrainingCrop crop = photos.Crop(64, random);
    ASSERT_EQ(crop.srgb.width, 64);
    ASSERT_EQ(crop.ab.channels, 2);
    ASSERT_NEAR(crop.srgb.At(2, 30, 30), 0.2f, 0.01f);
    for (float v : crop.luminance.data) {
      ASSERT_GE(v, 0.0f);
      ASSERT_LE(v, 100.0f);
    }
  }
}

TEST_F(PhotoSetTest, RejectsFolderWithoutColor) {
  Write("gray.png", Image(32, 32, 3, 0.4f));
  EXPECT_THROW(PhotoSet({{folder_, 1.0}}), Error);
  EXPECT_THROW(PhotoSet({}, {{folder_, 1.0}}), Error);
}

TEST(CropWindowTest, RotatedWindowsStayInsidePhoto) {
  const BytePhoto photo{40, 90, {}};
  Random random(6);
  for (int i = 0; i < 200; ++i) {
    const CropWindow window = RandomWindow(photo, {.min_area = 0.1, .max_turn = 0.5}, random);
    for (double u : {0.0, 1.0}) {
      for (double v : {0.0, 1.0}) {
        const auto at = window.At(u, v);
        ASSERT_GE(std::min(at[0], at[1]), -1e-9);
        ASSERT_LE(at[0], 40.0 + 1e-9);
        ASSERT_LE(at[1], 90.0 + 1e-9);
        const auto back = window.Inverse(at);
        ASSERT_NEAR(back[0], u, 1e-9);
        ASSERT_NEAR(back[1], v, 1e-9);
      }
    }
  }
}

}  // namespace
}  // namespace color3d
