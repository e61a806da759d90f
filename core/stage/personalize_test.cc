#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/colorizer/personal/train_colorizer.h"
#include "core/stage/context/stage_context.h"
#include "tests/support/stages/augmented_scene.h"

namespace color3d {
namespace {
using ::testing::AllOf;
using ::testing::HasSubstr;

class PersonalizeStageTest : public AugmentationStageTest {
 protected:
  std::string Personalize(const std::filesystem::path& other_colorizer = {}) {
    StageContext::Setup setup;
    setup.scene_folder = scratch_.path() / "scene";
    setup.inputs = inputs_;
    setup.output_folder = scratch_.path() / "out";
    std::filesystem::create_directories(setup.output_folder);
    StageContext context(setup, none_, warnings_, cancel_);
    ColorizerOptions options;
    options.iterations = 2;
    options.crop_px = options.max_side_px = 64;
    options.min_decoder_share = min_decoder_share_;
    RunPersonalize(options, context, "", other_colorizer);
    return Output(artifact::kColorizer);
  }
  struct Warnings : NullObserver {
    void OnWarning(const std::string& message) override { text += message; }
    void OnError(int64_t, const std::string& error_name, double) override {
      trains |= error_name == "train_l1_ab";
    }
    std::string text;
    bool trains = false;
  };
  Warnings warnings_;
  double min_decoder_share_ = ColorizerOptions().min_decoder_share;
};

TEST_F(PersonalizeStageTest, ReportsKeyViewWithoutColor) {
  Personalize();
  EXPECT_EQ(warnings_.text, "");
  AddInput(artifact::kKeyColor, EncodeAbPng(Image(kWidth, kHeight, 2, 0.3f)));
  Personalize();
  EXPECT_THAT(warnings_.text, AllOf(HasSubstr("almost no colour"), HasSubstr("hints")));
}

TEST_F(PersonalizeStageTest, TrainsNoDecoderWhereKeyViewShowsAllUnlessAsked) {
  AddInput(artifact::kCarryFacts, R"({"coverage": 1.0})");
  Personalize();
  EXPECT_FALSE(warnings_.trains);
  min_decoder_share_ = 0.0;
  Personalize();
  EXPECT_TRUE(warnings_.trains);
}

TEST_F(PersonalizeStageTest, TakesColorizerOfOtherScene) {
  const Image luminance = LuminanceOfLab(Painting(kWidth, kHeight));
  const auto colors = [&](const std::string& bytes) {
    return LoadColorizer(bytes, Encoder::Embedded(), 1)->Colorize(luminance).data;
  };
  const std::filesystem::path file = scratch_.path() / "other.c3c";
  const std::string other = Personalize();
  WriteFileAtomic(file, other);
  AddInput(artifact::kKeyColor, EncodeAbPng(Image(kWidth, kHeight, 2, 30.0f)));
  EXPECT_NE(colors(Personalize()), colors(other));
  EXPECT_EQ(colors(Personalize(file)), colors(other));
  WriteFileAtomic(file, "no colorizer");
  EXPECT_THROW(Personalize(file), Error);
}

TEST_F(PersonalizeStageTest, RefusesKeyColorOfAnotherShape) {
  AddInput(artifact::kKeyColor, EncodeAbPng(Image(kHeight, kWidth, 2, 30.0f)));
  try {
    Personalize();
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
    EXPECT_THAT(e.what(), AllOf(HasSubstr("72x96"), HasSubstr("64x48")));
  }
  AddInput(artifact::kKeyColor, EncodeAbPng(Image(2 * kWidth, 2 * kHeight, 2, 30.0f)));
  EXPECT_FALSE(Personalize().empty()) << "another size of the same shape is accepted";
}

// Otherwise other views would learn its grey.
TEST_F(PersonalizeStageTest, IgnoresUnpaintedPixels) {
  Image ab(kWidth, kHeight, 2, 30.0f), painted(kWidth, kHeight, 1, 1.0f);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = kWidth / 2; x < kWidth; ++x) {
      ab.At(0, y, x) = ab.At(1, y, x) = 0.0f;
      painted.At(0, y, x) = 0.0f;
    }
  }
  const auto right_of = [&](const Image& confidence) {
    AddInput(artifact::kKeyColor, EncodeAbPng(ab, confidence));
    const Image colors = LoadColorizer(Personalize(), Encoder::Embedded(), 1)
                             ->Colorize(LuminanceOfLab(Painting(kWidth, kHeight)));
    double sum = 0.0;
    for (int y = 0; y < colors.height; ++y) {
      for (int x = 3 * colors.width / 4; x < colors.width; ++x) sum += colors.At(0, y, x);
    }
    return sum / (colors.height * (colors.width - 3 * colors.width / 4));
  };
  EXPECT_LT(right_of(Image()), 5.0) << "painted grey";
  EXPECT_GT(right_of(painted), 15.0) << "not painted";
}

TEST_F(PersonalizeStageTest, IgnoresMaskedPixels) {
  Image mask(kWidth, kHeight, 1, 1.0f);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = kWidth / 2; x < kWidth; ++x) mask.At(0, y, x) = 0.0f;
  }
  Write("m.png", EncodePng8(mask));
  scene_.views[1].mask_file = "m.png";
  AddInput(artifact::kScene, SceneToJson(scene_));
  const auto learnt = [&](float masked_out) {
    Image ab(kWidth, kHeight, 2, 30.0f);
    for (size_t i = 0; i < mask.data.size(); ++i) {
      if (mask.data[i] == 0.0f) ab.data[i] = masked_out;
    }
    AddInput(artifact::kKeyColor, EncodeAbPng(ab));
    const Image colors = LoadColorizer(Personalize(), Encoder::Embedded(), 1)
                             ->Colorize(LuminanceOfLab(Painting(kWidth, kHeight)));
    double sum = 0.0;
    for (int y = 0; y < colors.height; ++y) sum += colors.At(0, y, colors.width - 8);
    return sum / colors.height;
  };
  EXPECT_GT(learnt(-60.0f), 15.0);
  EXPECT_NEAR(learnt(-60.0f), learnt(30.0f), 3.0);
}

TEST_F(PersonalizeStageTest, RefusesPaintedPartThatIsTooFine) {
  Image ab(4 * kWidth, 4 * kHeight, 2, 30.0f), painted(4 * kWidth, 4 * kHeight, 1);
  for (int x = 0; x < painted.width; ++x) painted.At(0, 10, x) = 1.0f;
  AddInput(artifact::kKeyColor, EncodeAbPng(ab, painted));
  try {
    Personalize();
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
    EXPECT_THAT(e.what(), AllOf(HasSubstr("too fine"), HasSubstr("strokes")));
  }
}

TEST_F(PersonalizeStageTest, TrainsOnGeneratedPictures) {
  // Another picture, because the key view itself is matched exactly.
  const Image luminance = LuminanceOfLab(Painting(kWidth / 2, kHeight));
  const auto colors = [&] {
    return LoadColorizer(Personalize(), Encoder::Embedded(), 1)->Colorize(luminance).data;
  };
  const std::vector<float> alone = colors();
  Run();
  for (const std::string& name : outputs_) AddInput(name, Output(name));
  EXPECT_NE(colors(), alone);
  AddInput(artifact::kAugmentationFacts, R"({"samples": []})");
  EXPECT_EQ(colors(), alone);
  AddInput(artifact::kAugmentationFacts, "[1]");
  EXPECT_THROW(Personalize(), Error);
}

}  // namespace
}  // namespace color3d
