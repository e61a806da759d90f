#include "core/encoder/encoder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/random.h"
#include "core/weights/safetensors.h"
#include "tests/support/networks/synthetic_networks.h"

namespace color3d {
namespace {

std::filesystem::path Golden(const std::string& name) {
  return std::filesystem::path(COLOR3D_SHARED_DATA) / "golden" / name;
}

Image RandomLuminance(int width, int height, uint64_t seed) {
  Random random(seed);
  Image image(width, height, 1);
  for (float& value : image.data) value = static_cast<float>(random.NextUniform(0.0, 100.0));
  return image;
}

TEST(EncoderTest, DescribesPicturesOfAnySize) {
  const auto encoder = Encoder::Embedded();
  const std::vector<double> reference = encoder->Describe(RandomLuminance(300, 200, 1));
  for (const auto& [width, height] : {std::pair{1, 1}, {5, 700}, {31, 33}, {500, 20}}) {
    const std::vector<double> descriptor = encoder->Describe(RandomLuminance(width, height, 2));
    ASSERT_EQ(descriptor.size(), reference.size());
    for (double value : descriptor) ASSERT_TRUE(std::isfinite(value));
  }
  EXPECT_THROW(encoder->Describe(Image(4, 4, 3)), Error);
  EXPECT_THROW(encoder->Describe(Image()), Error);
}

TEST(EncoderTest, ComputesDeepFeaturesOnCoarseGrid) {
  const auto encoder = Encoder::Embedded();
  const Image features = encoder->DeepFeatures(RandomLuminance(768, 384, 1));
  EXPECT_EQ(features.width, 24);
  EXPECT_EQ(features.height, 12);
  EXPECT_EQ(encoder->DeepFeatures(RandomLuminance(1, 1, 1)).width, 1);
}

TEST(EncoderTest, GivesSameResultOnSeveralThreads) {
  const auto encoder = Encoder::Embedded();
  const Image picture = RandomLuminance(120, 80, 4);
  const std::vector<double> expected = encoder->Describe(picture);
  std::vector<std::vector<double>> answers(4);
  std::vector<std::thread> threads;
  for (auto& answer : answers) {
    threads.emplace_back([&] { answer = encoder->Describe(picture); });
  }
  for (auto& thread : threads) thread.join();
  for (const auto& answer : answers) {
    for (size_t i = 0; i < expected.size(); ++i) ASSERT_NEAR(answer[i], expected[i], 1e-5);
  }
}

TEST(EncoderTest, ReadsConvNextOfDdcolor) {
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

TEST(EncoderTest, ReadsClip) {
  const ScratchFolder folder;
  const auto path = folder.path() / "clip.safetensors";
  WriteFileAtomic(path, SerializeSafetensors(SyntheticClipWeights({}, 1), true));
  EXPECT_EQ(Encoder::FromWeightFile(path)->Describe(Image(100, 70, 1, 30.0f)).size(), 32u);
}

TEST(EncoderTest, ListsKnownEncodersForOtherFiles) {
  const ScratchFolder folder;
  const auto path = folder.path() / "other.safetensors";
  WriteFileAtomic(path, SerializeSafetensors({{"x", {{1}, {0.0f}}}}, false));
  EXPECT_THROW(Encoder::FromWeightFile(path), Error);
}

TEST(EncoderTest, ReadsAllFormatsAsSameEncoder) {
  if (!std::filesystem::exists(Golden("ddcolor_mini.safetensors"))) GTEST_SKIP() << "no data";
  const auto expected = Encoder::FromWeightFile(Golden("ddcolor_mini.safetensors"))->digest();
  EXPECT_EQ(Encoder::FromWeightFile(Golden("ddcolor_mini_params.pth"))->digest(), expected);
  EXPECT_EQ(Encoder::FromWeightFile(Golden("ddcolor_mini_raw.bin"))->digest(), expected);
  EXPECT_NE(Encoder::FromWeightFile(Golden("ddcolor_mini_f16.safetensors"))->digest(), expected);
}

}  // namespace
}  // namespace color3d
