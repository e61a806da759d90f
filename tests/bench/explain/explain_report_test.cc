#include "tests/bench/explain/explain_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace color3d {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

ModelStudy StudyOf(const std::string& name, double lambda) {
  ModelStudy study;
  study.name = name;
  study.lambda = lambda;
  study.taps = {{10, 1.0, 4.0}, {10, 3.0, 4.0}};
  study.decoder = {10, 0.5, 2.0};
  study.color = {10, 1.5 + lambda, 12.0};
  study.key_spread.variance = 2.0;
  study.other_spread = {7.0, 20.0, 0.9};
  study.delta_e00 = 4.25;
  study.norms = {.encoder = 2.0, .decoder = 3.0, .whole = 5.0};
  study.bound.points = 10;
  study.bound.color = 1.5;
  study.bound.bound = 30.0;
  study.bound.holds = 0.98;
  return study;
}

ExplainFacts Facts(bool adapters) {
  ExplainFacts facts{"banana", "DSC_0425.jpg", "ours", 14, 20, 5.6, adapters, {2, 4}};
  return facts;
}

TEST(ExplainReportTest, TablesHaveEachModel) {
  const std::string text =
      ExplainMarkdown(Facts(false), {StudyOf("before training", 0.0), StudyOf("trained", 1.0)});
  EXPECT_THAT(text, HasSubstr("| encoder, stride 2 px | 1 | 4 | 0.25 |"));
  EXPECT_THAT(text, HasSubstr("| encoder, stride 4 px | 3 | 4 | 0.75 |"));
  EXPECT_THAT(text, HasSubstr("| ab (Lab units), after | 2.5 | 12 | 0.21 |"));
  EXPECT_THAT(text, HasSubstr("| trained | 2 | 7 | 2.5 | 20 | 4.25 |"));
  EXPECT_THAT(text, HasSubstr("| 5 | 6 |"));  // norm of the whole, product of the parts
  EXPECT_THAT(text, HasSubstr("| 1.5 | 30 | 20 | 98 % |"));
  EXPECT_THAT(text, Not(HasSubstr("px, after")));
}

TEST(ExplainReportTest, EncoderWithAdaptersStandsTwice) {
  const std::string text =
      ExplainMarkdown(Facts(true), {StudyOf("before training", 0.0), StudyOf("trained", 0.0)});
  EXPECT_THAT(text, HasSubstr("| encoder, stride 2 px, before |"));
  EXPECT_THAT(text, HasSubstr("| encoder, stride 2 px, after |"));
}

TEST(ExplainReportTest, JsonHasEachModel) {
  const auto json =
      ExplainJson(Facts(false), {StudyOf("before training", 0.0), StudyOf("trained", 1.0)});
  ASSERT_EQ(json.at("models").size(), 2u);
  EXPECT_EQ(json.at("models")[1].at("lambda"), 1.0);
  EXPECT_EQ(json.at("models")[1].at("bound").at("whole_norm"), 5.0);
  EXPECT_EQ(json.at("models")[0].at("taps").size(), 2u);
}

TEST(ExplainReportTest, PictureHasColumnForEachView) {
  ViewMaps maps{Image(10, 8, 4, 1.0f), Image(20, 16, 4, 1.0f), Image(40, 32, 3, 0.25f)};
  for (size_t i = 0; i < maps.tap.data.size(); ++i) maps.tap.data[i] = static_cast<float>(i % 7);
  const FeatureColumn column{"a.jpg", Image(40, 32, 1, 50.0f), maps, maps};
  const Image one = FeaturePicture({column});
  const Image two = FeaturePicture({column, column});
  EXPECT_EQ(one.height, two.height);
  EXPECT_EQ(one.channels, 3);
  EXPECT_EQ(two.width - one.width, 226);  // a picture and a gap
  // The last row shows the answer, and reaches the lower border.
  EXPECT_NEAR(one.At(0, one.height - 5, 100), 0.25f, 5e-3);
}

}  // namespace
}  // namespace color3d
