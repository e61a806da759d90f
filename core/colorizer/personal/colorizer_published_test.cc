// Personalization on encoders of the user, with taps at strides 4..32 instead of 2..16.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/colorizer/personal/train_colorizer.h"
#include "core/weights/safetensors.h"
#include "tests/support/networks/synthetic_networks.h"

namespace color3d {
namespace {

std::shared_ptr<const Encoder> FromWeights(const WeightMap& weights) {
  const ScratchFolder folder;
  const auto path = folder.path() / "weights.safetensors";
  WriteFileAtomic(path, SerializeSafetensors(weights, /*half=*/false));
  return Encoder::FromWeightFile(path);
}

struct Key {
  Image luminance{150, 100, 1};
  Image ab{150, 100, 2};
};

Key MakeKey() {
  Key key;
  for (int y = 0; y < 100; ++y) {
    for (int x = 0; x < 150; ++x) {
      const bool left = x < 75;
      key.luminance.At(0, y, x) = 50.0f + 20.0f * std::sin(0.5f * (left ? y : x));
      key.ab.At(0, y, x) = left ? 30.0f : 5.0f;
      key.ab.At(1, y, x) = left ? 40.0f : -45.0f;
    }
  }
  return key;
}

std::shared_ptr<const Colorizer> Train(const std::shared_ptr<const Encoder>& encoder,
                                       ColorizerOptions::Recipe recipe,
                                       int iterations) {
  const Key key = MakeKey();
  ColorizerOptions options;
  options.recipe = recipe;
  options.iterations = iterations;
  options.crop_px = 64;
  ThreadPool pool(1);
  NoCheckpoints checkpoints;
  NullObserver progress;
  return TrainColorizer(
      encoder, {{"key", key.luminance, key.ab}}, options, {pool, checkpoints, progress, {}});
}

TEST(PublishedEncoderColorizerTest, LearnsKeyViewWithDdcolorEncoder) {
  const auto encoder = FromWeights(SyntheticDdcolorWeights(SyntheticDdcolor::Mini(), 1));
  const auto colorizer = Train(encoder, ColorizerOptions().recipe, 15);
  const Key key = MakeKey();
  const Image ab = colorizer->Colorize(key.luminance);
  ASSERT_EQ(ab.width, 150);
  ASSERT_EQ(ab.height, 100);
  double error = 0.0;
  double gray = 0.0;
  for (size_t i = 0; i < ab.data.size(); ++i) {
    error += std::abs(ab.data[i] - key.ab.data[i]);
    gray += std::abs(key.ab.data[i]);
  }
  EXPECT_LT(error, 0.3 * gray);
  // At another size, the colorizer from the file gives the same result.
  const Image other(61, 33, 1, 40.0f);
  const auto loaded = LoadColorizer(colorizer->Serialize(), encoder, 1);
  EXPECT_EQ(loaded->Colorize(other).data, colorizer->Colorize(other).data);
}

TEST(PublishedEncoderColorizerTest, TrainsAdaptersInEveryBlock) {
  const auto encoder = FromWeights(SyntheticDdcolorWeights(SyntheticDdcolor::Mini(), 1));
  const auto colorizer = Train(encoder, ColorizerOptions::Recipe::kPaper, 2);
  for (const float value : colorizer->Colorize(Image(40, 70, 1, 60.0f)).data) {
    ASSERT_TRUE(std::isfinite(value));
  }
}

TEST(PublishedEncoderColorizerTest, RefusesEncodersWithoutTaps) {
  const auto refused = [](const std::shared_ptr<const Encoder>& encoder, const char* reason) {
    try {
      Train(encoder, ColorizerOptions().recipe, 1);
      ADD_FAILURE() << "no error";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kFailedPrecondition);
      EXPECT_THAT(error.what(), testing::HasSubstr(reason));
    }
  };
  refused(FromWeights(SyntheticClipWeights({}, 1)), "CLIP");
}

}  // namespace
}  // namespace color3d
