#include "tests/bench/colorizer/choice_results.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/files.h"

namespace color3d {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

ChoicePoint PointOf(const std::string& scene,
                    const std::string& choice,
                    const std::string& value,
                    int iterations,
                    double error) {
  return {
      scene, choice, value, iterations, 0.1 * iterations, 0.2 * iterations, 3, error, error / 2};
}

std::vector<ChoicePoint> TwoScenes() {
  return {PointOf("fern", kDefaultChoice, "", 20, 4.0),
          PointOf("fern", kDefaultChoice, "", 60, 3.0),
          PointOf("fern", "crop", "128", 60, 3.5),
          PointOf("fern", "crop", "384", 60, 2.5),
          PointOf("fox", kDefaultChoice, "", 20, 6.0),
          PointOf("fox", kDefaultChoice, "", 60, 5.0),
          PointOf("fox", "crop", "128", 60, 5.5)};
}

TEST(ChoiceResults, IgnoreTruncatedLine) {
  const ScratchFolder folder;
  const auto file = folder.path() / "choices.jsonl";
  EXPECT_TRUE(ReadChoicePoints(file).empty());
  AppendChoicePoint(file, PointOf("fern", "crop", "128", 60, 3.0));
  WriteFileAtomic(file, ReadFile(file) + "{\"scene\": \"fo");
  AppendChoicePoint(file, PointOf("fern", "crop", "128", 60, 2.0));
  AppendChoicePoint(file, PointOf("fern", "crop", "128", 20, 4.0));
  const auto points = ReadChoicePoints(file);
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0].alone, 2.0) << "an earlier point won";
  EXPECT_EQ(points[0].delivered, 1.0);
  EXPECT_EQ(points[0].seconds, 6.0);
  EXPECT_TRUE(points[1].SameWork(PointOf("fern", "crop", "128", 20, 0.0)));
}

TEST(ChoiceTables, CompareEachChoiceWithDefault) {
  const std::string tables = ChoiceTables(TwoScenes());
  EXPECT_THAT(tables, HasSubstr("### default\n"));
  EXPECT_THAT(tables, HasSubstr("|  | 20 | 2.0 | 4.00 | 6.00 | 5.00 | 2.00 | 3.00 | 2.50 |\n"));
  EXPECT_THAT(tables,
              HasSubstr("| default | 60 | 6.0 | 3.00 | 5.00 | 4.00 | 1.50 | 2.50 | 2.00 |\n"
                        "| 128 | 60 | 6.0 | 3.50 | 5.50 | 4.50 | 1.75 | 2.75 | 2.25 |\n"));
  EXPECT_THAT(tables, Not(HasSubstr("| default | 20"))) << "no other value stops there";
  EXPECT_THAT(tables, Not(HasSubstr("384"))) << "one of the scenes is missing";
}

TEST(ChoicePlots, ShowMeansOverScenes) {
  const auto plots = ChoicePlots(TwoScenes(), /*delivered=*/true);
  ASSERT_EQ(plots.size(), 2u);
  EXPECT_EQ(plots[0].title, kDefaultChoice);
  ASSERT_EQ(plots[0].series.size(), 1u);
  ASSERT_EQ(plots[0].series[0].points.size(), 2u);
  EXPECT_EQ(plots[0].series[0].points[1].seconds, 6.0);
  EXPECT_EQ(plots[0].series[0].points[1].value, 2.0);
  ASSERT_EQ(plots[1].series.size(), 2u);
  EXPECT_EQ(plots[1].series[0].points.size(), 2u) << "the curve of the default is incomplete";
  EXPECT_EQ(plots[1].series[1].name, "128");
  EXPECT_EQ(plots[1].series[1].points[0].value, 2.25);
}

}  // namespace
}  // namespace color3d
