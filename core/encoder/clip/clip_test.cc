#include "core/encoder/clip/clip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/random.h"
#include "core/weights/weight_file.h"
#include "tests/support/networks/synthetic_networks.h"

namespace color3d {
namespace {

std::filesystem::path Golden(const std::string& name) {
  return std::filesystem::path(COLOR3D_SHARED_DATA) / "golden" / name;
}

// Largest difference, in units of the largest expected value.
double RelativeError(const std::vector<float>& values, const float* expected) {
  double worst = 0.0;
  double largest = 0.0;
  for (size_t i = 0; i < values.size(); ++i) {
    worst = std::max<double>(worst, std::abs(values[i] - expected[i]));
    largest = std::max<double>(largest, std::abs(expected[i]));
  }
  return worst / largest;
}

Image RandomPicture(int width, int height) {
  Random random(3);
  Image image(width, height, 3);
  for (float& value : image.data) value = static_cast<float>(random.NextUniform());
  return image;
}

TEST(ClipModelTest, EncodesOnlyPicturesWithoutVocabulary) {
  ClipModel model(SyntheticClipWeights({}, 7), true);
  EXPECT_EQ(model.ImageFeatures(RandomPicture(90, 50)).size(), 32u);
  EXPECT_THROW(model.TextFeatures("sky"), Error);
  WeightMap pictures_only = SyntheticClipWeights({}, 7);
  std::erase_if(pictures_only, [](const auto& item) { return !item.first.starts_with("visual."); });
  ClipModel vision(pictures_only, true);
  EXPECT_EQ(vision.ImageFeatures(RandomPicture(90, 50)),
            model.ImageFeatures(RandomPicture(90, 50)));
  EXPECT_THROW(vision.TextFeatures("sky"), Error);
  EXPECT_THROW(vision.LoadVocabulary("/nonexistent"), Error);
}

TEST(ClipModelTest, DependsOnActivation) {
  const ClipModel quick(SyntheticClipWeights({}, 7), true);
  const ClipModel exact(SyntheticClipWeights({}, 7), false);
  EXPECT_NE(quick.digest(), exact.digest());
  EXPECT_NE(quick.ImageFeatures(RandomPicture(64, 64)), exact.ImageFeatures(RandomPicture(64, 64)));
}

TEST(ClipModelTest, PatchFeaturesLocateParts) {
  const ClipModel model(SyntheticClipWeights({}, 7), true);
  Image picture(64, 64, 3, 0.5f);
  const Image before = model.PatchFeatures(picture);
  ASSERT_EQ(before.channels, 32);
  ASSERT_EQ(before.width, 4);
  Random random(1);
  for (int c = 0; c < 3; ++c) {
    for (int y = 16; y < 32; ++y) {
      for (int x = 48; x < 64; ++x) picture.At(c, y, x) = static_cast<float>(random.NextUniform());
    }
  }
  const Image after = model.PatchFeatures(picture);
  double changed_there = 0.0;
  double changed_elsewhere = 0.0;
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 4; ++x) {
      double change = 0.0;
      for (int c = 0; c < 32; ++c) change += std::abs(after.At(c, y, x) - before.At(c, y, x));
      double& largest = x == 3 && y == 1 ? changed_there : changed_elsewhere;
      largest = std::max(largest, change);
    }
  }
  EXPECT_GT(changed_there, 2.0 * changed_elsewhere);
}

TEST(ClipModelTest, DescribesGrayPicturesOfAnySize) {
  const ClipModel model(SyntheticClipWeights({}, 7), true);
  for (const auto& [width, height] : {std::pair{1, 1}, std::pair{200, 3}, std::pair{65, 64}}) {
    double sum = 0.0;
    for (const double value : model.Describe(Image(width, height, 1, 40.0f))) sum += value * value;
    EXPECT_NEAR(sum, 1.0, 1e-6);
  }
  EXPECT_THROW(model.Describe(Image(4, 4, 2)), Error);
  EXPECT_THROW(model.ImageFeatures(Image(4, 4, 2)), Error);
}

TEST(ClipModelTest, ReadsActivationFromConfig) {
  const ScratchFolder folder;
  const auto path = folder.path() / "clip.safetensors";
  WriteFileAtomic(path, SerializeSafetensors(SyntheticClipWeights({}, 1), false));
  const std::string quick = ClipModel::FromWeightFile(path)->digest();
  WriteFileAtomic(folder.path() / "config.json", R"({"vision_config": {"hidden_act": "gelu"}})");
  EXPECT_NE(ClipModel::FromWeightFile(path)->digest(), quick);
  WriteFileAtomic(folder.path() / "open_clip_config.json",
                  R"({"model_cfg": {"quick_gelu": true}})");
  EXPECT_EQ(ClipModel::FromWeightFile(path)->digest(), quick);
  WriteFileAtomic(folder.path() / "open_clip_config.json", "no json {");
  EXPECT_NO_THROW(ClipModel::FromWeightFile(path));
}

TEST(ClipModelTest, AgreesWithAuthorsNetwork) {
  if (!std::filesystem::exists(Golden("clip_mini.safetensors"))) GTEST_SKIP() << "no data";
  ClipModel clip(ReadWeightFile(Golden("clip_mini.safetensors")), /*quick_gelu=*/true);
  clip.LoadVocabulary(std::filesystem::path(COLOR3D_SHARED_DATA) /
                      "weights/clip_vocab/bpe_simple_vocab_16e6.txt.gz");
  const WeightMap expected = ReadWeightFile(Golden("clip_mini.expected.safetensors"));
  const WeightArray& image = expected.at("image");
  const char* prompts[] = {"red roses in front of a grey stone wall",
                           "a golden autumn forest, blue sky & white clouds"};
  for (int i = 0; i < 2; ++i) {
    Image picture(64, 64, 3);
    std::copy_n(
        image.values.begin() + i * picture.data.size(), picture.data.size(), picture.data.begin());
    const std::vector<float> features = clip.ImageFeatures(picture);
    EXPECT_LT(RelativeError(features, &expected.at("image_features").values[32 * i]), 1e-4);
    EXPECT_LT(
        RelativeError(clip.TextFeatures(prompts[i]), &expected.at("text_features").values[32 * i]),
        1e-4);
    const ClipScore score = clip.Score(picture, prompts[i]);
    EXPECT_NEAR(score.cosine, expected.at("cosine").values[4 * i + i], 1e-5);
    EXPECT_DOUBLE_EQ(score.score, 2.5 * std::max(score.cosine, 0.0));
  }
}

}  // namespace
}  // namespace color3d
