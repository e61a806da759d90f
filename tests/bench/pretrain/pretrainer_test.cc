#include "tests/bench/pretrain/pretrainer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/image/codec.h"
#include "core/keycolor/automatic/automatic.h"

namespace color3d {
namespace {

class PretrainerTest : public testing::Test {
 protected:
  PretrainerTest() {
    folder_ = std::filesystem::path(testing::TempDir()) /
              testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    // Blue above, green below, at several tones.
    for (int i = 0; i < 3; ++i) {
      Image photo(80, 64, 3);
      for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 80; ++x) {
          const float tone = 0.2f + 0.1f * static_cast<float>(i) + 0.1f * std::sin(0.3f * x);
          photo.At(0, y, x) = 0.5f * tone;
          photo.At(1, y, x) = y < 32 ? tone : 2.0f * tone;
          photo.At(2, y, x) = y < 32 ? 2.0f * tone : 0.5f * tone;
        }
      }
      WriteFileAtomic(folder_ / (std::to_string(i) + ".png"), EncodePng8(photo));
    }
    options_.iterations = 6;
    options_.batch = 2;
    options_.size_px = options_.late_size_px = 64;
  }
  ~PretrainerTest() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_;
  PretrainOptions options_;
};

TEST_F(PretrainerTest, AResumedRunEndsAsAnUninterruptedOne) {
  const PhotoSet photos({{folder_, 1.0}});
  Pretrainer straight(options_, photos, std::nullopt);
  std::string checkpoint;
  for (int i = 0; i < 4; ++i) {
    if (i == 2) checkpoint = straight.Checkpoint(R"({"seconds": 7})");
    EXPECT_TRUE(std::isfinite(straight.Step().color));
  }
  Pretrainer resumed(options_, photos, std::nullopt);
  EXPECT_EQ(resumed.Restore(checkpoint), R"({"seconds":7})");
  EXPECT_EQ(resumed.iteration(), 2);
  for (int i = 0; i < 2; ++i) resumed.Step();
  const WeightMap expected = straight.AveragedWeights();
  const WeightMap actual = resumed.AveragedWeights();
  ASSERT_EQ(expected.size(), actual.size());
  for (const auto& [name, array] : expected)
    ASSERT_EQ(array.values, actual.at(name).values) << name;
}

TEST_F(PretrainerTest, WhatItWritesIsAnAutomaticColorizer) {
  const PhotoSet photos({{folder_, 1.0}});
  Pretrainer trainer(options_, photos, std::nullopt);
  trainer.Step();
  WeightMap weights = trainer.AveragedWeights();
  weights["color_temperature"] = {{1}, {0.5f}};
  const AutomaticColor color =
      AutomaticColorizer::FromPretrained(weights)->Colorize(Image(64, 64, 1, 50.0f));
  for (float v : color.ab.data) ASSERT_TRUE(std::isfinite(v));
}

TEST_F(PretrainerTest, RefusesADamagedCheckpoint) {
  const PhotoSet photos({{folder_, 1.0}});
  Pretrainer trainer(options_, photos, std::nullopt);
  std::string checkpoint = trainer.Checkpoint("{}");
  checkpoint[checkpoint.size() / 2] ^= 1;
  EXPECT_THROW(trainer.Restore(checkpoint), Error);
}

TEST_F(PretrainerTest, RefusesAFolderWithoutColor) {
  std::filesystem::create_directories(folder_ / "empty");
  EXPECT_THROW(PhotoSet({{folder_ / "empty", 1.0}}), Error);
}

TEST_F(PretrainerTest, CropsAreTrueColorAndDegradedLuminance) {
  const PhotoSet photos({{folder_, 1.0}});
  Random random(5);
  for (int i = 0; i < 20; ++i) {
    const TrainingCrop crop = photos.Crop(64, random);
    ASSERT_EQ(crop.srgb.width, 64);
    ASSERT_EQ(crop.ab.channels, 2);
    for (float v : crop.luminance.data) {
      ASSERT_GE(v, 0.0f);
      ASSERT_LE(v, 100.0f);
    }
  }
}

}  // namespace
}  // namespace color3d
