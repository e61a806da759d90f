#include "core/stage/report/color_sections.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "tests/support/stages/evaluated_scene.h"

namespace color3d {
namespace {

using ColorSectionsTest = EvaluatedSceneTest;

TEST(FindUntrainedDecoderTest, IsOneWithShareButNoTraining) {
  const CurvePoint share{"personalize", 2.0, 100, "decoder_share", 0.05};
  const CurvePoint error{"personalize", 2.0, 0, "validation_delta_e00", 2.5};
  const auto decoder = FindUntrainedDecoder({share, error});
  ASSERT_TRUE(decoder.has_value());
  EXPECT_EQ(decoder->share, 0.05);
  EXPECT_EQ(decoder->iterations, 100);
  EXPECT_FALSE(FindUntrainedDecoder({error}).has_value());
  EXPECT_FALSE(
      FindUntrainedDecoder({share, {"personalize", 3.0, 5, "train_l1_ab", 4.0}}).has_value());
}

TEST_F(ColorSectionsTest, ReportsSourcesAndNextKeyView) {
  AddProvenance("p1.png", Halves({0.0f, 1.0f, 0.0f}, {0.0f, 1.0f, 0.0f}));
  AddProvenance("p2.png", Halves({1.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 1.0f}));
  AddInput(artifact::kCarryFacts, R"({"coverage": 0.61, "key_views": ["p1.png"]})");
  AddInput(artifact::kScores,
           R"({"mean": {}, "consistency": {"rendered": {"me": 0.02, "me_de00": 1.5, "tc": 0.001,
               "tc_short": 0.001, "tc_long": 0.001}}, "temporal": {"colored_views": {"pairs": 9,
               "followed": 0.8, "tc_chroma": 1.25, "chroma": 14, "cdc": 0.002}, "bound": {"pairs": 9,
               "followed": 0.8, "tc_chroma": 0.5, "chroma": 15, "cdc": 0.001}, "truth": {"pairs": 9,
               "followed": 0.8, "tc_chroma": 0.75, "chroma": 16, "cdc": 0.001}}, "sources": {"share_seen": 0.6,
               "delta_e00_seen": 1.25, "confidence_rank_correlation": -0.5}})");
  AddInput(ViewArtifact(artifact::kTruths, scene_.views[scene_.FindView("p1.png")], ".jpg"), "");
  AddInput(artifact::kAugmentationFacts,
           R"({"samples": [{"name": "file-1", "kind": "file", "source": "augment/a.png"},
               {"name": "animate-1", "kind": "animate", "source": "embedded"}]})");
  StageContext context = MakeContext();
  const ColorFacts facts(scene_, context, NextKeyViewFacts{"p0.png", 5.5, 3.25});
  std::map<std::string, double> metrics;
  for (const auto& [name, value] : facts.Metrics()) metrics[name] = value;
  EXPECT_NEAR(metrics.at("share_seen"), 0.5, 0.01);
  EXPECT_NEAR(metrics.at("share_inferred"), 0.25, 0.01);
  EXPECT_NEAR(metrics.at("share_guessed"), 0.25, 0.01);
  EXPECT_NEAR(metrics.at("share_seen_scored"), 1.0, 0.01);
  EXPECT_NEAR(metrics.at("share_inferred_scored"), 0.0, 0.01);
  EXPECT_THAT(facts.augmentations(), testing::ElementsAre("augment/a.png", "animate-1 (embedded)"));
  EXPECT_EQ(metrics.at("coverage"), 0.61);
  EXPECT_EQ(metrics.at("me"), 0.02);
  EXPECT_EQ(metrics.at("tc"), 0.001);
  EXPECT_EQ(metrics.at("tc_chroma"), 1.25) << "without a model the frames are what is delivered";
  EXPECT_EQ(metrics.at("tc_chroma_bound"), 0.5);
  EXPECT_EQ(metrics.at("cdc_truth"), 0.001);
  EXPECT_EQ(metrics.at("confidence_rank_correlation"), -0.5);
  const auto sections = facts.Sections({{"personalize", 1.0, 1, "validation_delta_e00", 9.0},
                                        {"personalize", 4.0, 60, "validation_delta_e00", 2.5},
                                        {"personalize", 4.0, 60, "stopped_early_iteration", 60.0}});
  ASSERT_EQ(sections.size(), 4u);
  EXPECT_THAT(sections[0].notes.back(), testing::HasSubstr("colour p0.png next"));
  EXPECT_THAT(sections[0].notes.back(), testing::HasSubstr("from 5.5 to 3.2"));
  ASSERT_EQ(sections[0].tables.size(), 2u);
  EXPECT_EQ(sections[0].tables[0].rows[0][0], "p2.png") << "least certain first";
  EXPECT_EQ(sections[0].rows.size(), 2u);
  EXPECT_EQ(sections[1].tables[0].rows[0][1], "0.0200");
  EXPECT_EQ(sections[2].tables[0].rows[1][1], "0.50");
  EXPECT_EQ(sections[2].tables[0].rows[2][1], "0.75");
  EXPECT_EQ(sections[3].curves.size(), 3u);
  EXPECT_THAT(sections[3].notes.front(), testing::HasSubstr("from 9.0 after 1 s to 2.5 after 4 s"));
  EXPECT_THAT(sections[3].notes.front(), testing::HasSubstr("ended at iteration 60"));
}

TEST_F(ColorSectionsTest, RefusesDamagedFacts) {
  {
    StageContext context = MakeContext();
    EXPECT_TRUE(ColorFacts(scene_, context).Sections({}).empty());
    EXPECT_TRUE(ColorFacts(scene_, context).Metrics().empty());
    EXPECT_TRUE(ReadViewConfidence(context, scene_.views[0], 48, 32).Empty());
  }
  AddInput(artifact::kCarryFacts, R"({"key_views": [3]})");
  StageContext context = MakeContext();
  EXPECT_THROW(ColorFacts(scene_, context), Error);
}

}  // namespace
}  // namespace color3d
