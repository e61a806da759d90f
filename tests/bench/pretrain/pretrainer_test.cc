#include "tests/bench/pretrain/pretrainer.h"

#include <gmock/gmock.h>
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
    // Blue above green, in several tones.
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

void ExpectEqual(const WeightMap& expected, const WeightMap& actual) {
  ASSERT_EQ(expected.size(), actual.size());
  for (const auto& [name, array] : expected)
    ASSERT_EQ(array.values, actual.at(name).values) << name;
}

TEST_F(PretrainerTest, ResumesWithSameResult) {
  const PhotoSet photos({{folder_, 1.0}});
  for (double copy_weight : {0.0, 1.0}) {
    options_.copy_weight = options_.contrast_weight = copy_weight;
    options_.half_precision = copy_weight > 0.0;
    Pretrainer straight(options_, photos, std::nullopt);
    std::string checkpoint;
    for (int i = 0; i < 4; ++i) {
      if (i == 2) checkpoint = straight.Checkpoint(R"({"seconds": 7})");
      const PretrainLosses losses = straight.Step();
      EXPECT_TRUE(std::isfinite(losses.color));
      EXPECT_EQ(losses.copy > 0.0, copy_weight > 0.0);
    }
    Pretrainer resumed(options_, photos, std::nullopt);
    EXPECT_EQ(resumed.Restore(checkpoint), R"({"seconds":7})");
    EXPECT_EQ(resumed.iteration(), 2);
    for (int i = 0; i < 2; ++i) resumed.Step();
    ExpectEqual(straight.AveragedWeights(), resumed.AveragedWeights());
  }
}

TEST_F(PretrainerTest, StartsFromWeights) {
  const PhotoSet photos({{folder_, 1.0}});
  Pretrainer trainer(options_, photos, std::nullopt);
  trainer.Step();
  WeightMap weights = trainer.AveragedWeights();
  weights.erase("color_weights");  // counted again
  options_.seed = 2;
  Pretrainer other(options_, photos, std::nullopt, &weights);
  EXPECT_EQ(other.iteration(), 0);
  WeightMap begin = other.AveragedWeights();
  EXPECT_EQ(begin.erase("color_weights"), 1u);
  ExpectEqual(weights, begin);
  other.Step();
  EXPECT_NE(weights.at("encoder.norm1.bias").values,
            other.AveragedWeights().at("encoder.norm1.bias").values);
}

TEST_F(PretrainerTest, NamesMissingStartWeights) {
  const PhotoSet photos({{folder_, 1.0}});
  const WeightMap good = Pretrainer(options_, photos, std::nullopt).AveragedWeights();
  const auto expect_refused = [&](const WeightMap& weights, const std::string& name) {
    try {
      Pretrainer(options_, photos, std::nullopt, &weights);
      FAIL() << name;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(name));
    }
  };
  for (const char* name : {"color_bins", "encoder.norm1.weight", "color_head.out.bias"}) {
    WeightMap weights = good;
    weights.erase(name);
    expect_refused(weights, name);
    weights[name] = {{1, 3}, {1.0f, 2.0f, 3.0f}};
    expect_refused(weights, name);
  }
  WeightMap weights = good;
  weights["encoder.norm1.weight"].values[0] = NAN;
  expect_refused(weights, "encoder.norm1.weight");
}

TEST_F(PretrainerTest, FollowsScheduleByTime) {
  const PhotoSet photos({{folder_, 1.0}});
  const auto change = [&](double progress) {
    Pretrainer trainer(options_, photos, std::nullopt);
    const WeightMap before = trainer.AveragedWeights();
    trainer.Step(progress);
    const std::vector<float>& x = before.at("color_head.out.bias").values;
    const std::vector<float> y = trainer.AveragedWeights().at("color_head.out.bias").values;
    double sum = 0.0;
    for (size_t i = 0; i < x.size(); ++i) sum += std::abs(x[i] - y[i]);
    return sum;
  };
  EXPECT_LT(change(1.0), 0.05 * change(0.0));
}

TEST_F(PretrainerTest, WritesAutomaticColorizer) {
  const PhotoSet photos({{folder_, 1.0}});
  Pretrainer trainer(options_, photos, std::nullopt);
  trainer.Step();
  WeightMap weights = trainer.AveragedWeights();
  weights["color_temperature"] = {{1}, {0.5f}};
  const AutomaticColor color =
      AutomaticColorizer::FromPretrained(weights)->Colorize(Image(64, 64, 1, 50.0f));
  for (float v : color.ab.data) ASSERT_TRUE(std::isfinite(v));
}

TEST_F(PretrainerTest, RejectsDamagedCheckpoint) {
  const PhotoSet photos({{folder_, 1.0}});
  Pretrainer trainer(options_, photos, std::nullopt);
  std::string checkpoint = trainer.Checkpoint("{}");
  checkpoint[checkpoint.size() / 2] ^= 1;
  EXPECT_THROW(trainer.Restore(checkpoint), Error);
}

}  // namespace
}  // namespace color3d
