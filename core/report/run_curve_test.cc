#include "core/report/run_curve.h"

#include <gtest/gtest.h>

#include "core/catalogue/error_model.h"
#include "core/catalogue/stages.h"

namespace color3d {
namespace {

const std::vector<RanStage> kStages = {{kind::kReconstructGeometry, 20.0},
                                       {kind::kCarryColor, 8.0},
                                       {kind::kPersonalize, 10.0},
                                       {kind::kColorizeViews, 6.0},
                                       {kind::kRender, 0.1}};
const std::vector<CurvePoint> kCurves = {
    {kind::kCarryColor, 7.9, 0, "coverage", 0.8},
    {kind::kPersonalize, 3.0, 1, "validation_delta_e00", 10.0},
    {kind::kPersonalize, 3.0, 1, "train_l1_ab", 99.0},
    {kind::kPersonalize, 9.0, 100, "validation_delta_e00", 4.0},
    {kind::kEvaluate, 2.0, 0, "delta_e00_chroma", 1.64}};

TEST(RunCurveTest, FallsWhenColorsAreCarriedAndLearnt) {
  const RunCurve curve = EstimateRunCurve(kStages, kCurves);
  ASSERT_FALSE(curve.points.empty());
  EXPECT_EQ(curve.points.front().seconds, 0.0);
  EXPECT_EQ(curve.points.front().error, 10.0) << "nothing is coloured";
  EXPECT_NEAR(curve.points.back().seconds, 44.1, 1e-9);
  EXPECT_NEAR(curve.points.back().error, 0.8 * 1.5 + 0.2 * 4.0, 1e-9);
  for (size_t i = 1; i < curve.points.size(); ++i) {
    EXPECT_GE(curve.points[i].seconds, curve.points[i - 1].seconds);
    EXPECT_LE(curve.points[i].error, curve.points[i - 1].error);
    if (curve.points[i].seconds < 28.0) {
      EXPECT_EQ(curve.points[i].error, 10.0);
    }
  }
  EXPECT_EQ(curve.true_error, 1.64);
}

TEST(RunCurveTest, ColorizerAloneHasItsOwnError) {
  std::vector<CurvePoint> curves = kCurves;
  curves.erase(curves.begin());
  curves.pop_back();
  const RunCurve curve = EstimateRunCurve({{kind::kPersonalize, 10.0}}, curves);
  EXPECT_EQ(curve.points.back().error, 4.0);
  EXPECT_FALSE(curve.true_error.has_value());
}

TEST(RunCurveTest, IsEmptyWithoutColorizer) {
  const RunCurve curve = EstimateRunCurve(kStages, {kCurves.front()});
  EXPECT_TRUE(curve.points.empty());
  EXPECT_TRUE(RunCurvePoints(curve).empty());
  EXPECT_TRUE(RunCurvePlot(curve).series.empty());
}

TEST(RunCurveTest, PointsLieOnOneClock) {
  const auto points = RunCurvePoints(EstimateRunCurve(kStages, kCurves));
  ASSERT_GT(points.size(), 6u);
  EXPECT_EQ(points.back().error_name, "delta_e00_chroma");
  EXPECT_EQ(points.back().value, 1.64);
  EXPECT_EQ(points.back().seconds, points[points.size() - 2].seconds);
  for (const CurvePoint& p : points) EXPECT_EQ(p.stage, "whole_run");
}

TEST(RunCurveTest, ShowsChromaSolverOnTheSameClock) {
  std::vector<RanStage> stages = kStages;
  stages.insert(stages.end() - 1, {kind::kSolveChroma, 3.0});
  std::vector<CurvePoint> curves = kCurves;
  curves.push_back({kind::kSolveChroma, 0.5, 0, "heldout_delta_e00", 1.2});
  curves.push_back({kind::kSolveChroma, 2.5, 40, "heldout_delta_e00", 0.7});
  curves.push_back({kind::kSolveChroma, 2.5, 40, "train_l1_ab", 99.0});
  curves.push_back({kind::kSolveChroma, 2.9, 0, "view_disagreement_ab", 1.1});
  const RunCurve curve = EstimateRunCurve(stages, curves);
  EXPECT_EQ(curve.points.back().error, EstimatedError({0.8, 4.0, 1.1}));
  ASSERT_EQ(curve.chroma.size(), 2u);
  EXPECT_DOUBLE_EQ(curve.chroma[0].seconds, 44.5);
  EXPECT_DOUBLE_EQ(curve.chroma[1].seconds, 46.5);
  EXPECT_EQ(curve.chroma[1].error, 0.7);
  int rows = 0;
  for (const CurvePoint& p : RunCurvePoints(curve)) {
    rows += p.stage == "whole_run" && p.error_name == "heldout_delta_e00";
  }
  EXPECT_EQ(rows, 2);
  const Plot plot = RunCurvePlot(curve);
  ASSERT_GE(plot.series.size(), 2u);
  EXPECT_EQ(plot.series[plot.series.size() - 2].name, "chroma, held out");
}

TEST(RunCurveTest, PlotHasOneBandPerLongStage) {
  const Plot plot = RunCurvePlot(EstimateRunCurve(kStages, kCurves));
  std::vector<std::string> names;
  for (const PlotSeries& series : plot.series) names.push_back(series.name);
  EXPECT_EQ(names,
            (std::vector<std::string>{
                "reconstruct geometry", "carry color", "personalize", "colorize views", "truth"}));
  for (size_t i = 1; i + 1 < plot.series.size(); ++i) {
    EXPECT_EQ(plot.series[i].points.front().seconds, plot.series[i - 1].points.back().seconds);
  }
}

}  // namespace
}  // namespace color3d
