#include "core/stage/coloring/view_coloring.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/carry/confidence.h"
#include "core/keycolor/automatic/automatic.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {
using Method = ColorizeViewsOptions::Method;

// Three views of a ramp. The key view p1 is (15, 15); (30, -30) was carried into the left half of
// the others.
class ViewColoringTest : public StageTest {
 protected:
  ViewColoringTest() : scene_(RampScene(scratch_.path(), kWidth, kHeight)) {
    for (const std::vector<int>& views : {std::vector<int>{0, 1}, {1, 2}}) {
      for (int i = 0; i < 30; ++i) {
        SparsePoint point;
        point.position = {0.0, 0.0, 5.0};
        point.views = views;
        scene_.points.push_back(point);
      }
    }
    AddInput(artifact::kScene, SceneToJson(scene_));
    AddInput(artifact::kKeyView, R"({"view": "p1.png"})");
    AddInput(artifact::kKeyColor, EncodeAbPng(Image(kWidth, kHeight, 2, 15.0f)));
    AddInput(artifact::kGeometry, SerializeGaussians(SmallModel()));
  }
  void Carry() {
    Image ab(kWidth, kHeight, 2, -30.0f);
    std::fill_n(ab.Plane(0), ab.PlaneSize(), 30.0f);
    Image left(kWidth, kHeight, 1);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth / 2; ++x) left.At(0, y, x) = 1.0f;
    }
    for (const View& view : scene_.views) {
      AddInput(ViewArtifact(artifact::kCarried, view),
               view.name == "p1.png" ? EncodeAbPng(Image(kWidth, kHeight, 2, 15.0f))
                                     : EncodeAbPng(ab, left));
    }
    AddInput(artifact::kCarryFacts, R"({"key_views": ["p1.png"]})");
  }
  void Train(const ColorizerOptions& options) {
    StageContext context = MakeContext();
    RunPersonalize(options, context);
    AddInput(artifact::kColorizer, ReadFile(scratch_.path() / "out" / artifact::kColorizer));
  }
  // Colours all views.
  void Color(Method method, bool guess = true) {
    std::filesystem::remove_all(scratch_.path() / "out");
    StageContext context = MakeContext();
    RunColorizeViews({.max_side_px = kWidth, .method = method, .guess = guess}, context);
  }
  Image AbOf(int view) {
    const std::string name = ViewArtifact(artifact::kViewsAb, scene_.views[view]);
    return DecodeAbPng(ReadFile(scratch_.path() / "out" / name), name).ab;
  }
  Image ProvenanceOf(int view) {
    const std::string name = ViewArtifact(artifact::kProvenance, scene_.views[view]);
    return DecodeImage(ReadFile(scratch_.path() / "out" / name), name);
  }
  static float MeanDistance(const Image& a, const Image& b) {
    double sum = 0.0;
    for (size_t i = 0; i < a.data.size(); ++i) sum += std::abs(a.data[i] - b.data[i]);
    return static_cast<float>(sum / static_cast<double>(a.data.size()));
  }
  Image GivenColor() const { return Image(kWidth, kHeight, 2, 15.0f); }

  static constexpr int kWidth = 96, kHeight = 72;
  static constexpr float kStored = 0.6f;  // rounding of stored chroma
  Scene scene_;
};

TEST_F(ViewColoringTest, GrayKeepsKeyViewAlone) {
  Color(Method::kGray);
  EXPECT_LT(MeanDistance(AbOf(0), Image(kWidth, kHeight, 2)), kStored);
  EXPECT_LT(MeanDistance(AbOf(1), GivenColor()), kStored);
  EXPECT_EQ(ProvenanceOf(1).At(kSeenPlane, 5, 5), 1.0f);
  EXPECT_EQ(ProvenanceOf(0).At(kGuessedPlane, 5, 5), 1.0f);
}

TEST_F(ViewColoringTest, CarriedIsGrayWhereNothingWasCarried) {
  Carry();
  Color(Method::kCarried);
  const Image ab = AbOf(2);
  EXPECT_NEAR(ab.At(0, 30, 10), 30.0f, kStored);
  EXPECT_NEAR(ab.At(1, 30, 10), -30.0f, kStored);
  EXPECT_NEAR(ab.At(0, 30, kWidth - 10), 0.0f, kStored);
  EXPECT_EQ(ProvenanceOf(2).At(kSeenPlane, 30, kWidth - 10), 0.0f);
  EXPECT_LT(MeanDistance(AbOf(1), GivenColor()), kStored);
}

TEST_F(ViewColoringTest, AutomaticColorsEachViewByItself) {
  Carry();
  Color(Method::kAutomatic);
  const ViewImages images(scene_, scratch_.path(), kWidth, 0);
  const Image guess = AutomaticColorizer::Embedded()->Colorize(*images.Luminance(2)).ab;
  EXPECT_LT(MeanDistance(AbOf(2), guess), kStored);
  EXPECT_LT(MeanDistance(AbOf(1), GivenColor()), kStored);
}

TEST_F(ViewColoringTest, FlowReachesConnectedViews) {
  Color(Method::kFlow);
  EXPECT_EQ(observer_.text, "");
  for (const int view : {0, 1, 2}) EXPECT_LT(MeanDistance(AbOf(view), GivenColor()), kStored);
}

TEST_F(ViewColoringTest, FlowLeavesUnconnectedViewGrayAndWarns) {
  scene_.points.resize(30);  // p2 shares none
  AddInput(artifact::kScene, SceneToJson(scene_));
  Color(Method::kFlow);
  EXPECT_LT(MeanDistance(AbOf(0), GivenColor()), kStored);
  EXPECT_LT(MeanDistance(AbOf(2), Image(kWidth, kHeight, 2)), kStored);
  EXPECT_NE(observer_.text.find("1 views share no point"), std::string::npos) << observer_.text;
  EXPECT_NE(observer_.text.find("p2.png"), std::string::npos);
}

TEST_F(ViewColoringTest, FlowFollowsFilm) {
  scene_.points.clear();
  for (size_t i = 0; i < scene_.views.size(); ++i) {
    scene_.views[i].moment = Moment{0.1 * static_cast<double>(i), 0};
  }
  AddInput(artifact::kScene, SceneToJson(scene_));
  AddInput(artifact::kGeometry, SerializeGaussians(BallBeforeWall(0.0, 0.2)));
  Color(Method::kFlow);
  for (const int view : {0, 2}) EXPECT_LT(MeanDistance(AbOf(view), GivenColor()), kStored);
}

TEST_F(ViewColoringTest, NeighborsAndDecoderAreParts) {
  Train({.iterations = 20});
  Color(Method::kNearestNeighbors);
  const Image neighbors = AbOf(2);
  EXPECT_LT(MeanDistance(neighbors, GivenColor()), 1.5f) << "the key view has one colour";
  Color(Method::kDecoder);
  EXPECT_GT(MeanDistance(AbOf(2), neighbors), 0.05f);
  EXPECT_EQ(ProvenanceOf(2).At(kInferredPlane, 5, 5), 1.0f);
}

TEST_F(ViewColoringTest, PaperRecipeHasNoNeighbors) {
  ColorizerOptions options{.iterations = 0};
  options.UsePaperRecipe();
  Train(options);
  try {
    Color(Method::kNearestNeighbors);
    ADD_FAILURE() << "it found neighbours";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kFailedPrecondition);
  }
}

TEST_F(ViewColoringTest, JointTrainingKeepsEachKeyView) {
  const ColorizerOptions options{.iterations = 10};
  Train(options);
  const std::string alone = ReadFile(inputs_.at(artifact::kColorizer));
  const std::string folder = std::string(artifact::kKeyViews) + "1/";
  AddInput(folder + artifact::kKeyColor, EncodeAbPng(Image(kWidth, kHeight, 2, -20.0f)));
  AddInput(folder + artifact::kKeyColorFacts, R"({"view": "p2.png"})");
  Train(options);
  EXPECT_NE(ReadFile(inputs_.at(artifact::kColorizer)), alone);
  Color(Method::kPersonalized);
  EXPECT_LT(MeanDistance(AbOf(2), Image(kWidth, kHeight, 2, -20.0f)), kStored);
  EXPECT_LT(MeanDistance(AbOf(1), GivenColor()), kStored);
  AddInput(folder + artifact::kKeyColorFacts, R"({"view": "p1.png"})");
  EXPECT_THROW(Train(options), Error) << "named twice";
}

TEST_F(ViewColoringTest, PersonalizedUsesNoCarriedColors) {
  Train({.iterations = 0});
  Carry();
  Color(Method::kPersonalized);
  EXPECT_LT(MeanDistance(AbOf(2), GivenColor()), 1.5f);
  Color(Method::kFusion);
  EXPECT_GT(MeanDistance(AbOf(2), GivenColor()), 10.0f) << "the left half was carried";
}

}  // namespace
}  // namespace color3d
