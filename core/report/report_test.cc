#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/report/curves.h"
#include "core/report/plot.h"
#include "core/report/report_page.h"
#include "core/report/scene_plan.h"

namespace color3d {
namespace {

class MemoryCheckpoints : public CheckpointStore {
 public:
  std::optional<std::string> Load() override { return saved_; }
  bool WantsSave() override { return true; }
  void Save(const std::string& state) override { saved_ = state; }

 private:
  std::optional<std::string> saved_;
};

TEST(Curves, CsvRoundTrip) {
  const std::vector<CurvePoint> points{{"geometry", 0.1, 10, "train_l1_l", 1e-7},
                                       {"geometry", 12.75, 1000000, "heldout_psnr_l_db", 22.5}};
  const auto back = CurvesFromCsv(CurvesToCsv(points));
  ASSERT_EQ(back.size(), 2u);
  EXPECT_EQ(back[0].value, 1e-7);
  EXPECT_EQ(back[1].iteration, 1000000);
  EXPECT_EQ(back[1].error_name, "heldout_psnr_l_db");
  EXPECT_THROW(CurvesFromCsv("a,b,c\n"), Error);
  EXPECT_THROW(CurvesFromCsv("a,x,1,e,2\n"), Error);
}

TEST(CurveRecorder, ResumesPointsAndClock) {
  MemoryCheckpoints checkpoints;
  NullObserver outer;
  {
    CurveRecorder first("stage", outer, checkpoints);
    EXPECT_FALSE(first.Load().has_value());
    first.OnError(1, "error", 3.0);
    first.OnError(2, "error", std::numeric_limits<double>::quiet_NaN());  // never recorded
    first.Save("trainer state");
  }
  CurveRecorder second("stage", outer, checkpoints);
  EXPECT_EQ(second.Load().value(), "trainer state");
  second.OnError(3, "error", 2.0);
  const auto points = second.points();
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0].iteration, 1);
  EXPECT_EQ(points[1].iteration, 3);
  EXPECT_GE(points[1].seconds, points[0].seconds);
}

TEST(CurveRecorder, RefusesADamagedCheckpoint) {
  MemoryCheckpoints checkpoints;
  NullObserver outer;
  checkpoints.Save(std::string(16, '\xff'));
  CurveRecorder recorder("stage", outer, checkpoints);
  EXPECT_THROW(recorder.Load(), Error);
}

TEST(Plot, FigureDrawsEverySeriesOnItsAxes) {
  Plot plot{"fox & friends", {{"fast", {}}, {"best", {}}}, /*log_seconds=*/true};
  plot.series[0].points = {{"", 0.0, 0, "", 9.0}, {"", 2.0, 10, "", 22.0}, {"", 9.0, 50, "", 26.0}};
  plot.series[1].points = {{"", 40.0, 100, "", 27.0}};
  const std::string svg = FigureSvg({plot, Plot{"empty", {}}});
  EXPECT_NE(svg.find("fox &amp; friends"), std::string::npos);
  EXPECT_NE(svg.find(">best<"), std::string::npos);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
  // 0 s has no place on a logarithmic axis: two points are left of the first line.
  const size_t begin = svg.find("points=\"") + 8;
  const std::string first = svg.substr(begin, svg.find('/', begin) - begin);
  EXPECT_EQ(std::count(first.begin(), first.end(), ','), 2);
}

TEST(Plot, ALineOfOnePointIsSeenAndTheLegendIsWhereNoLineEnds) {
  Plot falling{"error", {{"x", {{"", 1.0, 0, "", 9.0}, {"", 9.0, 0, "", 1.0}}}, {"y", {}}}};
  falling.series[1].points = {{"", 5.0, 0, "", 2.0}};
  const std::string low = FigureSvg({falling});
  EXPECT_NE(low.find("<circle"), std::string::npos);
  const auto legend_y = [](const std::string& svg) {
    const size_t at = svg.rfind("y=\"", svg.find(">x</text>")) + 3;
    return std::stod(svg.substr(at));
  };
  EXPECT_LT(legend_y(low), 60.0);
  for (PlotSeries& series : falling.series) {
    for (CurvePoint& p : series.points) p.value = 10.0 - p.value;
  }
  EXPECT_GT(legend_y(FigureSvg({falling})), 120.0);
}

TEST(Plot, ResidualsHaveALogarithmicAxis) {
  const std::vector<CurvePoint> points{{"key", 1.0, 1, "relative_residual", 0.1},
                                       {"key", 2.0, 2, "relative_residual", 0.0001}};
  EXPECT_NE(PlotsSvg(points).find(">0.001<"), std::string::npos);
  const std::vector<CurvePoint> zero{{"key", 1.0, 1, "relative_residual", 0.0}};
  EXPECT_EQ(PlotsSvg(zero).find("nan"), std::string::npos);
}

TEST(ScenePlan, LeavesOutWhatTheSceneDoesNotNeed) {
  PlanFacts facts;
  facts.has_poses = true;
  facts.views = 20;
  const auto plan = PlanFromJson(PlanToJson(PlanScene(facts)));
  int left_out = 0;
  for (const PlanStep& s : plan) {
    EXPECT_FALSE(s.reason.empty()) << s.step;
    EXPECT_TRUE(s.step != "structure_from_motion" || !s.needed);
    EXPECT_TRUE(s.step != "luminance_geometry" || s.needed);
    left_out += !s.needed;
  }
  EXPECT_GE(left_out, 5);
  facts.has_poses = false;
  EXPECT_TRUE(PlanScene(facts)[0].needed);
  EXPECT_THROW(PlanFromJson("[{\"step\": 3}]"), Error);
}

TEST(Report, EscapesTextAndPlotsConstantCurves) {
  ReportData data;
  data.title = "<script>";
  data.views = {{"view & more", {{"a \"caption\"", std::string("\xff\xd8jpeg")}}}};
  data.curves = {{"s", 1.0, 1, "e", 2.0}, {"s", 1.0, 2, "e", 2.0}};
  const std::string html = RenderReport(data);
  EXPECT_EQ(html.find("<script>"), std::string::npos);
  EXPECT_NE(html.find("&lt;script&gt;"), std::string::npos);
  EXPECT_NE(html.find("data:image/jpeg;base64,/9hqcGVn"), std::string::npos);
  EXPECT_EQ(html.find("nan"), std::string::npos);
  EXPECT_NE(html.find("polyline"), std::string::npos);
}

TEST(Report, SectionsShowWhatTheyHave) {
  ReportData data;
  data.sections.push_back(
      {"Where <colour> comes from",
       {"61 % seen & verified."},
       {{{"view", "seen"}, {{"a<b.jpg", "0.61"}}}},
       {"sheet", "\xff\xd8jpeg"},
       {{"a.jpg", {{"provenance", "\x89PNG"}}}},
       {{"personalize", 1.0, 1, "heldout_l1", 2.0}, {"personalize", 2.0, 2, "heldout_l1", 1.0}}});
  data.sections.push_back({"Empty one"});
  const std::string html = RenderReport(data);
  EXPECT_NE(html.find("<h2>Where &lt;colour&gt; comes from</h2>"), std::string::npos);
  EXPECT_NE(html.find("61 % seen &amp; verified."), std::string::npos);
  EXPECT_NE(html.find("<tr><td>a&lt;b.jpg</td><td class=\"v\">0.61</td></tr>"), std::string::npos);
  EXPECT_NE(html.find("personalize: heldout_l1"), std::string::npos);
  EXPECT_EQ(PlotsSvg({{"evaluate", 1.0, 0, "delta_e00", 2.0}}), "") << "one point is no curve";
  EXPECT_NE(html.find("data:image/png"), std::string::npos);
  EXPECT_TRUE(html.find("<h2>Empty one</h2></body>") != std::string::npos) << html;
}

TEST(Report, KeyViewSectionTellsChoiceAndColour) {
  ReportData data;
  data.key_view.pictures = {"a.jpg", {{"as captured", "\x89PNG"}}};
  data.key_view.notes = {"Best of 5 views, narrowly ahead of <b>."};
  data.key_view.ranking = {"all candidates", "\xff\xd8jpeg"};
  data.key_view.color_facts = {{"source", "prompt"}, {"regions", "\"sky\" & lawn"}};
  const std::string html = RenderReport(data);
  EXPECT_NE(html.find("narrowly ahead of &lt;b&gt;."), std::string::npos);
  EXPECT_NE(html.find("<td>source</td><td>prompt</td>"), std::string::npos);
  EXPECT_NE(html.find("&amp; lawn"), std::string::npos);
  EXPECT_NE(html.find("data:image/jpeg"), std::string::npos);
  EXPECT_EQ(RenderReport({}).find("Key view"), std::string::npos);
}

}  // namespace
}  // namespace color3d
