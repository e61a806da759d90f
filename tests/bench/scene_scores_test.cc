#include "tests/bench/scene_scores.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/image/codec.h"
#include "core/weights/safetensors.h"
#include "tests/support/networks/perceptual_weights.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class SceneScoresTest : public ::testing::Test {
 protected:
  // A view whose photo and picture are the same texture.
  void AddView(int view, bool swap_channels = false) {
    const std::string stem = "v" + std::to_string(view);
    Image photo(96, 72, 3);
    for (int y = 0; y < photo.height; ++y) {
      for (int x = 0; x < photo.width; ++x) {
        const double wave = std::sin(0.31 * x + 0.17 * y) * std::cos(0.23 * y);
        photo.At(0, y, x) = static_cast<float>(0.6 + 0.2 * wave);
        photo.At(1, y, x) = static_cast<float>(0.4 + 0.2 * wave);
        photo.At(2, y, x) = static_cast<float>(0.3 + 0.2 * wave);
      }
    }
    Image picture = photo;
    if (swap_channels) {
      std::copy_n(photo.Plane(0), photo.PlaneSize(), picture.Plane(2));
      std::copy_n(photo.Plane(2), photo.PlaneSize(), picture.Plane(0));
    }
    PictureScores scores;
    scores.view = stem;
    scores.photo = Write(stem + "_photo.png", EncodePng8(photo));
    scores.picture = Write(stem + ".png", EncodePng8(picture));
    views_.push_back(scores);
  }
  fs::path Write(const std::string& name, const std::string& bytes) {
    WriteFileAtomic(scratch_.path() / name, bytes);
    return scratch_.path() / name;
  }
  fs::path Write(const std::string& name, const WeightMap& weights) {
    return Write(name, SerializeSafetensors(weights, false));
  }
  PerceptualScores Perception() const {
    return ScorePerception(views_, options_, CancellationToken());
  }
  Consistency Common() const {
    ThreadPool pool(2);
    return ScoreCommonMatches(views_, pool, CancellationToken());
  }
  std::string ErrorText() const {
    try {
      Perception();
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  }

  ScratchFolder scratch_;
  std::vector<PictureScores> views_;
  PerceptualOptions options_;
};

TEST_F(SceneScoresTest, NamesScoresThatAreLeftOut) {
  AddView(0);
  const PerceptualScores scores = Perception();
  EXPECT_FALSE(scores.fid);
  EXPECT_THAT(scores.left_out.at("fid"), HasSubstr("--fid-weights"));
  EXPECT_THAT(scores.left_out.at("ref_lpips"), HasSubstr("--lpips-weights"));
  EXPECT_THAT(scores.left_out.at("clip_score"), HasSubstr("--clip-weights"));
}

TEST_F(SceneScoresTest, FidOfFewPicturesIsLeftOutOrMarked) {
  for (int i = 0; i < 3; ++i) AddView(i, /*swap_channels=*/i > 0);
  options_.fid_weights = Write("fid.safetensors", SmallInceptionWeights(1008)).string();
  const PerceptualScores left_out = Perception();
  EXPECT_FALSE(left_out.fid);
  EXPECT_THAT(left_out.left_out.at("fid"), HasSubstr("3 pictures"));
  options_.allow_biased_fid = true;
  const PerceptualScores scores = Perception();
  ASSERT_TRUE(scores.fid);
  EXPECT_TRUE(scores.fid_is_biased);
  EXPECT_GT(*scores.fid, 1e-4);
  EXPECT_FALSE(scores.left_out.contains("fid"));
}

TEST_F(SceneScoresTest, FidOfTrueColorsIsZero) {
  for (int i = 0; i < 3; ++i) AddView(i);
  options_.fid_weights = Write("fid.safetensors", SmallInceptionWeights(1008)).string();
  options_.allow_biased_fid = true;
  EXPECT_NEAR(*Perception().fid, 0.0, 1e-6);
}

TEST_F(SceneScoresTest, ReferenceDistanceNoticesSwappedChannels) {
  AddView(0);
  AddView(1, /*swap_channels=*/true);
  options_.lpips_weights = Write("alexnet.safetensors", SmallAlexNetWeights()).string();
  options_.lpips_linear = Write("alex.safetensors", SmallLpipsLinearWeights("alex")).string();
  options_.reference = views_[0].photo.string();
  const std::vector<double> distances = Perception().of_views.at("ref_lpips");
  ASSERT_EQ(distances.size(), 2u);
  EXPECT_EQ(distances[0], 0.0);
  EXPECT_GT(distances[1], 1e-3);
}

TEST_F(SceneScoresTest, CommonMatchesNoticeViewOfOtherColors) {
  AddView(0);
  AddView(1);
  const Consistency equal = Common();
  EXPECT_GT(equal.matches, 300);  // of 768
  EXPECT_NEAR(equal.me, 0.0, 1e-3);
  views_.pop_back();
  AddView(1, /*swap_channels=*/true);
  EXPECT_EQ(Common().matches, equal.matches);
  EXPECT_GT(Common().me, 0.1);
}

TEST_F(SceneScoresTest, RejectsHalfOptionsAndOtherWeights) {
  AddView(0);
  options_.prompt = "roses";
  EXPECT_THAT(ErrorText(), HasSubstr("--clip-weights is missing"));
  options_.prompt.clear();
  options_.allow_biased_fid = true;
  EXPECT_THAT(ErrorText(), HasSubstr("--fid-weights is missing"));
  options_.fid_weights = Write("other.safetensors", SmallVggWeights()).string();
  EXPECT_THAT(ErrorText(), HasSubstr("Conv2d_1a_3x3.conv.weight"));
}

}  // namespace
}  // namespace color3d
