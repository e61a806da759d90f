#include "core/keycolor/words/prompt.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/base/error.h"

namespace color3d {
namespace {

// Recognizes three things by brightness in the grey picture: bright sky, dark grass, and walls in
// between. Features: (bright, middle, dark, nothing).
class BrightnessModel : public TextImageModel {
 public:
  Image PatchFeatures(const Image& srgb) const override {
    constexpr int kGrid = 7;
    Image features(kGrid, kGrid, 4);
    for (int y = 0; y < kGrid; ++y) {
      for (int x = 0; x < kGrid; ++x) {
        const float value = srgb.At(
            0, (2 * y + 1) * srgb.height / (2 * kGrid), (2 * x + 1) * srgb.width / (2 * kGrid));
        const int kind = value > 0.7f ? 0 : value > 0.3f ? 1 : 2;
        features.At(kind, y, x) = 3.0f;
        features.At(3, y, x) = 0.3f;
      }
    }
    return features;
  }
  std::vector<float> TextFeatures(const std::string& text) const override {
    const auto has = [&](const char* word) { return text.find(word) != std::string::npos; };
    if (has("sky")) return {2.0f, 0.0f, 0.0f, 0.0f};
    if (has("wall")) return {0.0f, 2.0f, 0.0f, 0.0f};
    if (has("grass")) return {0.0f, 0.0f, 2.0f, 0.0f};
    return {0.1f, 0.1f, 0.1f, 1.0f};
  }
};

// Bright above, dark below, a middle block on the right.
Image Scene(int width, int height) {
  Image l(width, height, 1, 85.0f);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (y >= height / 2) l.At(0, y, x) = 20.0f;
      if (x >= width / 2 && y >= height / 4 && y < 3 * height / 4) l.At(0, y, x) = 50.0f;
    }
  }
  return l;
}

PromptSolution SolveWith(const PromptOptions& options,
                         const Image& l,
                         const std::string& prompt,
                         const Image& rest,
                         const CancellationToken& cancel = {}) {
  ThreadPool pool;
  NoCheckpoints none;
  NullObserver silent;
  return KeyColorFromPrompt(
      l, prompt, BrightnessModel(), rest, options, {pool, none, silent, cancel});
}

PromptSolution Solve(const Image& l, const std::string& prompt, const Image& rest = {}) {
  return SolveWith({}, l, prompt, rest);
}

TEST(PromptTest, ColorsRegionsByPhrases) {
  const Image l = Scene(320, 240);
  const PromptSolution solution = Solve(l, "blue sky over green grass, and a red wall");
  ASSERT_EQ(solution.regions.size(), 3u);
  for (const PromptRegion& region : solution.regions) {
    EXPECT_TRUE(region.found) << region.phrase.thing;
    EXPECT_GT(region.share, 0.15);
    EXPECT_GT(region.score, 0.9);
  }
  EXPECT_LT(solution.ab.At(1, 20, 80), -5.0f);    // sky: blue
  EXPECT_LT(solution.ab.At(0, 220, 80), -3.0f);   // grass: green
  EXPECT_GT(solution.ab.At(0, 120, 240), 20.0f);  // wall: red
  EXPECT_GT(solution.confidence.At(0, 20, 80), 0.8f);
  EXPECT_GT(solution.regions[0].mask.At(0, 10, 30), 0.9f);
  EXPECT_GT(solution.spread.hinted_pixels, 100);
}

TEST(PromptTest, ReportsMissingPhrases) {
  Image l(200, 150, 1, 85.0f);  // nothing but sky
  const PromptSolution solution = Solve(l, "blue sky, red wall");
  EXPECT_TRUE(solution.regions[0].found);
  EXPECT_FALSE(solution.regions[1].found);
  ASSERT_EQ(solution.notes.size(), 1u);
  EXPECT_THAT(solution.notes[0], testing::HasSubstr("wall"));
  for (int y = 0; y < l.height; y += 10) {
    for (int x = 0; x < l.width; x += 10) EXPECT_LT(solution.ab.At(1, y, x), -3.0f);
  }
  try {
    Solve(l, "green grass, red wall");
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kFailedPrecondition);
    EXPECT_THAT(error.what(), testing::HasSubstr("grass"));
  }
}

TEST(PromptTest, ColorsUnnamedAreasFromRest) {
  // The model knows no unicorn: its text is near the "nothing" feature, which no patch shows.
  const Image l = Scene(320, 240);
  Image rest(320, 240, 2);
  std::fill_n(rest.Plane(1), rest.PlaneSize(), 30.0f);
  PromptOptions options;
  options.temperature = 0.5;  // the background takes its share where no phrase fits well
  options.seed_confidence = 0.02;
  const PromptSolution solution = SolveWith(options, l, "blue sky", rest);
  EXPECT_LT(solution.ab.At(1, 20, 80), 0.0f);
  EXPECT_GT(solution.ab.At(1, 220, 80), 15.0f);
  EXPECT_FLOAT_EQ(solution.confidence.At(0, 220, 80), 0.0f);
}

TEST(PromptTest, IsRepeatable) {
  const Image l = Scene(200, 300);
  const PromptSolution a = Solve(l, "blue sky, green grass");
  const PromptSolution b = Solve(l, "blue sky, green grass");
  EXPECT_EQ(a.ab.data, b.ab.data);
  EXPECT_EQ(a.confidence.data, b.confidence.data);
}

TEST(PromptTest, AcceptsPicturesOfAnySize) {
  for (const auto& [width, height] :
       {std::pair{1, 1}, std::pair{3, 200}, std::pair{500, 7}, std::pair{20000, 2}}) {
    const Image l(width, height, 1, 85.0f);
    const PromptSolution solution = Solve(l, "blue sky");
    EXPECT_EQ(solution.ab.width, width);
    EXPECT_EQ(solution.confidence.height, height);
    for (const float value : solution.ab.data) ASSERT_TRUE(std::isfinite(value));
  }
}

TEST(PromptTest, RefusesBadInput) {
  EXPECT_THROW(Solve(Image(4, 4, 3), "blue sky"), Error);
  EXPECT_THROW(Solve(Image(4, 4, 1), "a castle"), Error);
  EXPECT_THROW(Solve(Image(4, 4, 1), "blue sky", Image(3, 4, 2)), Error);
  PromptOptions options;
  options.windows_per_side = {9};
  EXPECT_THROW(options.Validate(), Error);
  options = {};
  options.temperature = 0.0;
  EXPECT_THROW(options.Validate(), Error);
}

TEST(PromptTest, StopsWhenCancelled) {
  CancellationToken cancel;
  cancel.Cancel();
  EXPECT_THROW(SolveWith({}, Scene(100, 80), "blue sky", {}, cancel), Error);
}

}  // namespace
}  // namespace color3d
