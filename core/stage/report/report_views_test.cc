#include "core/stage/report/report_views.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/image/codec.h"
#include "core/report/curves.h"
#include "core/stage/report/source_overlay.h"
#include "tests/support/stages/evaluated_scene.h"

namespace color3d {
namespace {

class ReportViewsTest : public EvaluatedSceneTest {};

TEST_F(ReportViewsTest, EveryViewHasPhotoAndRender) {
  AddInput(ViewArtifact(artifact::kTruths, scene_.views[1], ".jpg"),
           EncodeJpeg(Image(48, 32, 3, 0.5f)));
  StageContext context = MakeContext();
  const auto views = ReportViews(scene_, context);
  ASSERT_EQ(views.size(), scene_.views.size());
  size_t with_truth = 0;
  for (const ReportView& view : views) {
    ASSERT_GE(view.pictures.size(), 2u);
    EXPECT_EQ(view.pictures[0].role, "gray");
    EXPECT_EQ(view.pictures[1].role, "render");
    EXPECT_EQ(view.pictures[1].width, 48);
    if (view.pictures.size() == 3) with_truth += view.pictures[2].role == "truth";
  }
  EXPECT_EQ(with_truth, 1u);
}

TEST_F(ReportViewsTest, ReportsUnfinishedWork) {
  StageContext context = MakeContext();  // no key view, no scores, no export, no import facts
  RunReport({{.kind = "solve_chroma", .state = "SUCCEEDED", .seconds = 2.0}}, context);
  EXPECT_THAT(context.outputs(), testing::Contains(artifact::kReport));
  const std::string html = ReadFile(scratch_.path() / "out" / artifact::kReport);
  EXPECT_THAT(html, testing::HasSubstr("id=\"compare\""));
  EXPECT_THAT(html, testing::HasSubstr("solve chroma"));
  EXPECT_THAT(html, testing::Not(testing::HasSubstr("Key view</h2>")));
  EXPECT_THAT(html, testing::Not(testing::HasSubstr("view.html")));
}

TEST_F(ReportViewsTest, ReportsMotionOfPosedFilm) {
  for (int i = 0; i < 3; ++i) scene_.views[i].moment = Moment{0.5 * i, 0};
  AddInput(artifact::kScene, SceneToJson(scene_));
  AddInput(artifact::kImportFacts, ImportFactsToJson({.layout = CaptureLayout::kFilm}));
  AddInput(std::string(artifact::kCurves) + "reconstruct_geometry.csv",
           CurvesToCsv({{"reconstruct_geometry", 1.0, 100, "moving_share", 0.03}}));
  for (const bool moves : {false, true}) {
    AddInput(artifact::kModel, SerializeGaussians(moves ? BallBeforeWall(0.0, 1.0) : SmallModel()));
    std::filesystem::remove_all(scratch_.path() / "out");
    StageContext context = MakeContext();
    RunReport({}, context);
    const auto read = [&](const char* name) {
      return nlohmann::json::parse(ReadFile(scratch_.path() / "out" / name));
    };
    const char* motion = moves ? "partly dynamic" : "static";
    EXPECT_EQ(read(artifact::kMetrics).at("motion"), motion);
    EXPECT_EQ(read(artifact::kMetrics).at("moving_share"), 0.03);
    for (const auto& step : read(artifact::kPlan)) {
      if (step.at("step") != "deformation_over_time") continue;
      EXPECT_EQ(step.at("needed"), moves);
      EXPECT_EQ(step.at("motion"), motion);
    }
  }
}

TEST_F(ReportViewsTest, PlanNamesTheStrategyAndEveryStage) {
  AddInput(artifact::kImportFacts, ImportFactsToJson({.layout = CaptureLayout::kPhotos}));
  AddInput(artifact::kKeyView, R"({"view": "p1.png", "strategy": "tracks"})");
  StageContext context = MakeContext();
  RunReport({{.kind = "carry_color", .state = "SKIPPED", .skip_reason = "for this test"},
             {.kind = "export", .state = "SUCCEEDED", .seconds = 2.0}},
            context);
  const std::string plan = ReadFile(scratch_.path() / "out" / artifact::kPlan);
  EXPECT_THAT(plan, testing::HasSubstr("chosen by the sparse points"));
  EXPECT_THAT(plan, testing::Not(testing::HasSubstr("feature coverage")));
  for (const auto& step : nlohmann::json::parse(plan)) {
    if (step.at("step") == "carried_color") {
      EXPECT_EQ(step.at("needed"), false);
      EXPECT_EQ(step.at("reason"), "for this test");
    }
    if (step.at("step") == "export") {
      EXPECT_EQ(step.at("measured_seconds"), 2.0);
    }
  }
}

// A metric without a row in core/catalogue/metrics.cc is shown by its key.
TEST_F(ReportViewsTest, ShowsUnknownMetrics) {
  AddInput(artifact::kScores,
           R"({"mean": {"colorfulness_2d": 20.5, "sharpness": 7.25},
               "consistency": {"rendered": {"pairs": 1, "matches": 1, "me": 0.02, "flicker": 0.125}}})");
  StageContext context = MakeContext();
  RunReport({}, context);
  const auto metrics =
      nlohmann::json::parse(ReadFile(scratch_.path() / "out" / artifact::kMetrics));
  EXPECT_EQ(metrics.at("colorfulness_2d"), 20.5);
  EXPECT_EQ(metrics.at("sharpness"), 7.25);
  EXPECT_EQ(metrics.at("flicker"), 0.125);
  EXPECT_FALSE(metrics.contains("pairs"));
  const std::string html = ReadFile(scratch_.path() / "out" / artifact::kReport);
  EXPECT_THAT(html, testing::HasSubstr("flicker"));
}

TEST(SourceOverlayTest, SourcesDifferByLightnessAndPattern) {
  const Image photo(32, 16, 3, 0.6f);
  const auto shaded = [&](float guessed, float seen, float inferred) {
    Image shares(32, 16, 3);
    const float of[] = {guessed, seen, inferred};
    for (int c = 0; c < 3; ++c) std::fill_n(shares.Plane(c), shares.PlaneSize(), of[c]);
    return ShadeBySource(photo, shares);
  };
  const Image seen = shaded(0.0f, 1.0f, 0.0f), inferred = shaded(0.0f, 0.0f, 1.0f),
              guessed = shaded(1.0f, 0.0f, 0.0f);
  EXPECT_GT(seen.At(1, 5, 5), seen.At(0, 5, 5) + 0.1f) << "teal";
  EXPECT_GT(inferred.At(0, 5, 5), inferred.At(2, 5, 5) + 0.1f) << "amber";
  EXPECT_GT(std::abs(guessed.At(0, 0, 0) - guessed.At(0, 0, 4)), 0.15f) << "stripes";
  EXPECT_EQ(inferred.At(2, 0, 0), inferred.At(2, 0, 4)) << "no stripes";
}

}  // namespace
}  // namespace color3d
