#include "core/keycolor/automatic/automatic.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/color/difference.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/encoder/embedded/embedded_weights.h"
#include "core/image/codec.h"

namespace color3d {
namespace {

Image Texture(int width, int height) {
  Image luminance(width, height, 1);
  Random random(3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      luminance.At(0, y, x) = static_cast<float>(
          50.0 + 30.0 * std::sin(0.15 * x) * std::cos(0.11 * y) + random.NextUniform(-3.0, 3.0));
    }
  }
  return luminance;
}

void ExpectSane(const AutomaticColor& color, int width, int height) {
  ASSERT_EQ(color.ab.width, width);
  ASSERT_EQ(color.ab.height, height);
  ASSERT_EQ(color.ab.channels, 2);
  ASSERT_EQ(color.confidence.width, width);
  ASSERT_EQ(color.confidence.height, height);
  for (float v : color.ab.data) ASSERT_LE(std::abs(v), 128.0f);  // NaN fails too
  for (float v : color.confidence.data) {
    ASSERT_GE(v, 0.0f);
    ASSERT_LE(v, 1.0f);
  }
}

TEST(AutomaticColorizerTest, ColorsPicturesOfAnySize) {
  const auto colorizer = AutomaticColorizer::Embedded();
  const std::vector<std::pair<int, int>> sizes{{1, 1}, {3, 200}, {97, 64}, {500, 333}, {33, 1}};
  for (const auto& [width, height] : sizes) {
    ExpectSane(colorizer->Colorize(Texture(width, height)), width, height);
  }
}

TEST(AutomaticColorizerTest, ColorsExtremePictures) {
  const auto colorizer = AutomaticColorizer::Embedded();
  for (float value : {0.0f, 50.0f, 100.0f}) {
    ExpectSane(colorizer->Colorize(Image(80, 60, 1, value)), 80, 60);
  }
}

TEST(AutomaticColorizerTest, IsRepeatableAndMirrorSymmetric) {
  const auto colorizer = AutomaticColorizer::Embedded();
  const Image picture = Texture(128, 96);
  Image mirrored = picture;
  for (int y = 0; y < 96; ++y) {
    for (int x = 0; x < 128; ++x) mirrored.At(0, y, x) = picture.At(0, y, 127 - x);
  }
  const AutomaticColor once = colorizer->Colorize(picture);
  EXPECT_EQ(once.ab.data, colorizer->Colorize(picture).ab.data);
  const AutomaticColor other = colorizer->Colorize(mirrored);
  for (int y = 0; y < 96; ++y) {
    for (int x = 0; x < 128; ++x) {
      ASSERT_NEAR(once.ab.At(0, y, x), other.ab.At(0, y, 127 - x), 0.05);
      ASSERT_NEAR(once.ab.At(1, y, x), other.ab.At(1, y, 127 - x), 0.05);
    }
  }
}

TEST(AutomaticColorizerTest, RefusesOtherChannelCounts) {
  const auto colorizer = AutomaticColorizer::Embedded();
  EXPECT_THROW(colorizer->Colorize(Image(8, 8, 3)), Error);
  EXPECT_THROW(colorizer->Colorize(Image()), Error);
}

TEST(AutomaticColorizerTest, NamesMissingOrMisshapenWeights) {
  for (const char* name : {"color_bins", "color_temperature", "color_head.out.weight"}) {
    WeightMap weights = EmbeddedWeights("");
    weights.erase(name);
    try {
      AutomaticColorizer::FromPretrained(weights);
      FAIL() << name;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(name));
    }
  }
  WeightMap weights = EmbeddedWeights("");
  weights["color_head.out.bias"].shape = {1, 2};
  EXPECT_THROW(AutomaticColorizer::FromPretrained(weights), Error);
}

TEST(AutomaticColorizerTest, ColorWeightsLowerOvercountedColors) {
  WeightMap weights = EmbeddedWeights("");
  const auto bins = static_cast<size_t>(weights["color_bins"].shape[0]);
  std::vector<float> counted(bins, 1.0f);
  const std::vector<float>& centers = weights["color_bins"].values;
  for (size_t i = 0; i < bins; ++i) {
    if (std::hypot(centers[2 * i], centers[2 * i + 1]) > 1.0f) counted[i] = 1e6f;
  }
  weights["color_weights"] = {{static_cast<int64_t>(bins)}, counted};
  const AutomaticColor gray =
      AutomaticColorizer::FromPretrained(weights)->Colorize(Texture(64, 64));
  for (float v : gray.ab.data) ASSERT_NEAR(v, 0.0f, 0.5f);
  for (float v : gray.confidence.data) ASSERT_GT(v, 0.95f);
  weights["color_weights"].shape = {1, 2};
  EXPECT_THROW(AutomaticColorizer::FromPretrained(weights), Error);
}

TEST(EmbeddedWeightsTest, HaveBoundedSize) {
  EXPECT_LE(EmbeddedWeightFile().size(), 12'000'000u);
  EXPECT_FALSE(EmbeddedWeights("encoder.").empty());
  EXPECT_TRUE(EmbeddedWeights("nothing.").empty());
}

// On held-out photographs: less error than grey, and a plausible colourfulness.
TEST(AutomaticColorizerTest, BeatsGrayOnHeldOutPhotos) {
  const std::filesystem::path folder =
      std::filesystem::path(COLOR3D_SHARED_DATA) / "photos/validate";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no photographs";
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file() && HasImageExtension(entry.path().string())) {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  const auto colorizer = AutomaticColorizer::Embedded();
  double error = 0.0;
  double gray_error = 0.0;
  double colorfulness = 0.0;
  double true_colorfulness = 0.0;
  for (size_t i = 0; i < files.size(); i += 2) {
    const Image truth = LabFromSrgb(FitWithin(ReadImage(files[i]), 256));
    const Image luminance = LuminanceOfLab(truth);
    const Image predicted = JoinLab(luminance, colorizer->Colorize(luminance).ab);
    error += MeanDeltaE00(predicted, truth);
    gray_error += MeanDeltaE00(JoinLab(luminance, Image(truth.width, truth.height, 2)), truth);
    colorfulness += Colorfulness(SrgbFromLab(predicted));
    true_colorfulness += Colorfulness(SrgbFromLab(truth));
  }
  EXPECT_LT(error, 0.88 * gray_error);
  EXPECT_GT(colorfulness, 0.3 * true_colorfulness);
  EXPECT_LT(colorfulness, 2.0 * true_colorfulness);
}

}  // namespace
}  // namespace color3d
