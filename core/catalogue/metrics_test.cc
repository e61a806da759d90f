#include "core/catalogue/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

namespace color3d {
namespace {
using ::testing::ElementsAre;

TEST(MetricCatalogueTest, HasOneRowForEachKey) {
  std::set<std::string> keys;
  for (const Metric& metric : MetricCatalogue()) {
    EXPECT_TRUE(keys.insert(metric.key).second) << metric.key;
    EXPECT_STRNE(metric.label, "") << metric.key;
  }
}

TEST(MetricCatalogueTest, FindsVariantsBySuffix) {
  const FoundMetric found = FindMetric("delta_e00_chroma_2d");
  ASSERT_NE(found.metric, nullptr);
  EXPECT_STREQ(found.metric->key, "delta_e00_chroma");
  EXPECT_STREQ(found.variant->suffix, "_2d");
  EXPECT_STREQ(FindMetric("delta_e00_chroma_2d_camera").metric->key, "delta_e00_chroma");
  EXPECT_EQ(FindMetric("me_de00").variant, nullptr);
  EXPECT_EQ(FindMetric("sharpness").metric, nullptr);
  EXPECT_EQ(FindMetric("sharpness_2d").metric, nullptr);
}

TEST(MetricCatalogueTest, UnknownKeysAreShownLastAndRaw) {
  EXPECT_THAT(InMetricOrder({"sharpness", "psnr_rgb", "delta_e00_chroma_2d", "delta_e00_chroma"}),
              ElementsAre("delta_e00_chroma", "delta_e00_chroma_2d", "psnr_rgb", "sharpness"));
  EXPECT_THAT(ColumnsOf(MetricTable::kAgreement, {"tc", "pairs", "sharpness", "me"}),
              ElementsAre("me", "tc", "sharpness"));
  EXPECT_EQ(MetricLabel("sharpness"), "sharpness");
  EXPECT_EQ(MetricText("sharpness", 0.125), "0.125");
}

TEST(MetricCatalogueTest, FormatsValuesWithUnit) {
  EXPECT_EQ(MetricText("psnr_rgb", 27.594), "27.59 dB");
  EXPECT_EQ(MetricText("share_seen_scored", 0.614), "61 %");
  EXPECT_EQ(MetricLabel("tc_chroma_truth"), "TC of chroma, true colours");
}

}  // namespace
}  // namespace color3d
