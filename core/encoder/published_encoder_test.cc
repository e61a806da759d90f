// Encoder::FromWeightFile, and agreement with the authors' networks on files they wrote.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/encoder/clip/clip.h"
#include "core/encoder/encoder.h"
#include "core/encoder/random_features.h"
#include "core/weights/weight_file.h"
#include "tests/support/synthetic_networks.h"

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

TEST(PublishedEncoderTest, TakesTheConvNextOfADdcolor) {
  const ScratchFolder folder;
  const auto path = folder.path() / "ddcolor.safetensors";
  WriteFileAtomic(
      path, SerializeSafetensors(SyntheticDdcolorWeights(SyntheticDdcolor::Mini(), 1), false));
  const auto encoder = Encoder::FromWeightFile(path);
  EXPECT_EQ(encoder->Describe(Image(100, 70, 1, 30.0f)).size(), 2u * 128);
  const Image deep = encoder->DeepFeatures(Image(320, 160, 1, 30.0f));
  EXPECT_EQ(deep.channels, 64);  // the tap at stride 16, not the last one
  EXPECT_EQ(deep.width, 20);
  EXPECT_EQ(deep.height, 10);
}

TEST(PublishedEncoderTest, TakesAClip) {
  const ScratchFolder folder;
  const auto path = folder.path() / "clip.safetensors";
  WriteFileAtomic(path, SerializeSafetensors(SyntheticClipWeights({}, 1), true));
  EXPECT_EQ(Encoder::FromWeightFile(path)->Describe(Image(100, 70, 1, 30.0f)).size(), 32u);
}

TEST(PublishedEncoderTest, SaysWhatItKnowsWhenTheFileIsAnother) {
  const ScratchFolder folder;
  const auto path = folder.path() / "other.safetensors";
  WriteFileAtomic(path, SerializeSafetensors({{"x", {{1}, {0.0f}}}}, false));
  EXPECT_THROW(Encoder::FromWeightFile(path), Error);
}

TEST(PublishedEncoderTest, TheActivationIsReadBesideTheWeights) {
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

TEST(PublishedEncoderTest, AllFormatsAreTheSameEncoder) {
  if (!std::filesystem::exists(Golden("ddcolor_mini.safetensors"))) GTEST_SKIP() << "no data";
  const auto expected = Encoder::FromWeightFile(Golden("ddcolor_mini.safetensors"))->digest();
  EXPECT_EQ(Encoder::FromWeightFile(Golden("ddcolor_mini_params.pth"))->digest(), expected);
  EXPECT_EQ(Encoder::FromWeightFile(Golden("ddcolor_mini_raw.bin"))->digest(), expected);
  EXPECT_NE(Encoder::FromWeightFile(Golden("ddcolor_mini_f16.safetensors"))->digest(), expected);
}

TEST(PublishedEncoderTest, ClipAgreesWithTheAuthorsNetwork) {
  if (!std::filesystem::exists(Golden("clip_mini.safetensors"))) GTEST_SKIP() << "no data";
  ClipOptions options;
  options.vocabulary = std::filesystem::path(COLOR3D_SHARED_DATA) /
                       "weights/clip_vocab/bpe_simple_vocab_16e6.txt.gz";
  const auto clip = ClipModel::FromWeightFile(Golden("clip_mini.safetensors"), options);
  const WeightMap expected = ReadWeightFile(Golden("clip_mini.expected.safetensors"));
  const WeightArray& image = expected.at("image");
  const char* prompts[] = {"red roses in front of a grey stone wall",
                           "a golden autumn forest, blue sky & white clouds"};
  for (int i = 0; i < 2; ++i) {
    Image picture(64, 64, 3);
    std::copy_n(
        image.values.begin() + i * picture.data.size(), picture.data.size(), picture.data.begin());
    const std::vector<float> features = clip->ImageFeatures(picture);
    EXPECT_LT(RelativeError(features, &expected.at("image_features").values[32 * i]), 1e-4);
    EXPECT_LT(
        RelativeError(clip->TextFeatures(prompts[i]), &expected.at("text_features").values[32 * i]),
        1e-4);
    const ClipScore score = clip->Score(picture, prompts[i]);
    EXPECT_NEAR(score.cosine, expected.at("cosine").values[4 * i + i], 1e-5);
    EXPECT_DOUBLE_EQ(score.score, 2.5 * std::max(score.cosine, 0.0));
  }
}

}  // namespace
}  // namespace color3d
