#include "core/report/plot.h"

#include <gtest/gtest.h>

namespace color3d {
namespace {

TEST(PlotTest, DrawsEverySeries) {
  Plot plot{"fox & friends", {{"fast", {}}, {"best", {}}}, /*log_seconds=*/true};
  plot.series[0].points = {{"", 0.0, 0, "", 9.0}, {"", 2.0, 10, "", 22.0}, {"", 9.0, 50, "", 26.0}};
  plot.series[1].points = {{"", 40.0, 100, "", 27.0}};
  const std::string svg = FigureSvg({plot, Plot{"empty", {}}});
  EXPECT_NE(svg.find("fox &amp; friends"), std::string::npos);
  EXPECT_NE(svg.find(">best<"), std::string::npos);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
  // A logarithmic axis has no 0 s: two points of the first line remain.
  const size_t begin = svg.find("points=\"") + 8;
  const std::string first = svg.substr(begin, svg.find('/', begin) - begin);
  EXPECT_EQ(std::count(first.begin(), first.end(), ','), 2);
}

TEST(PlotTest, ShowsSinglePointsAndPlacesLegend) {
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

TEST(PlotTest, DrawsResidualsOnLogarithmicAxis) {
  const std::vector<CurvePoint> points{{"key", 1.0, 1, "relative_residual", 0.1},
                                       {"key", 2.0, 2, "relative_residual", 0.0001}};
  EXPECT_NE(PlotsSvg(points).find(">0.001<"), std::string::npos);
  const std::vector<CurvePoint> zero{{"key", 1.0, 1, "relative_residual", 0.0}};
  EXPECT_EQ(PlotsSvg(zero).find("nan"), std::string::npos);
}

}  // namespace
}  // namespace color3d
