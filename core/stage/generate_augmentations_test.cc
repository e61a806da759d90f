// The stage generate_augmentations: files and a generator of the user, and embedded surrogates.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "tests/support/stages/augmented_scene.h"

namespace color3d {
namespace {
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST_F(AugmentationStageTest, MakesEightPicturesWithGeometry) {
  AddGeometry();
  const auto facts = Run();
  EXPECT_THAT(Names(facts),
              ElementsAre("outpaint-1",
                          "outpaint-2",
                          "outpaint-3",
                          "outpaint-4",
                          "animate-1",
                          "novel_view-1",
                          "novel_view-2",
                          "novel_view-3"));
  EXPECT_THAT(facts.at("left_out"), IsEmpty());
  const Image key = Painting(kWidth, kHeight);
  for (const std::string& name : Names(facts)) {
    const std::string stem = "augmentations/" + name;
    const Image l = LuminanceFromSrgb(DecodeImage(Output(stem + ".png"), name));
    const AbMap ab = DecodeAbPng(Output(stem + ".ab.png"), name);
    const Image weight = DecodeImage(Output(stem + ".weight.png"), name);
    ASSERT_EQ(l.width, kWidth);
    ASSERT_EQ(ab.ab.width, kWidth);
    ASSERT_EQ(weight.channels, 1);
    int weighed = 0;
    for (size_t i = 0; i < weight.PlaneSize(); ++i) {
      if (weight.data[i] == 0.0f) continue;
      ++weighed;
      ASSERT_NEAR(ab.ab.Plane(1)[i], 20.0f, 3.0f)
          << name << ": a colour that the key view does not have";
    }
    EXPECT_GT(weighed, kWidth * kHeight / 2) << name;
  }
  EXPECT_EQ(DecodeImage(Output("augmentations.jpg"), "sheet").channels, 3);
}

TEST_F(AugmentationStageTest, NovelViewShiftsWallByDisparity) {
  AddGeometry();
  options_.outpaint = options_.animate = false;
  const auto facts = Run();
  EXPECT_THAT(Names(facts), ElementsAre("novel_view-1", "novel_view-2", "novel_view-3"));
  const AbMap right = DecodeAbPng(Output("augmentations/novel_view-1.ab.png"), "right");
  const AbMap left = DecodeAbPng(Output("augmentations/novel_view-2.ab.png"), "left");
  // Both turn about the middle of the wall, which stays where it is.
  const Image key = Painting(kWidth, kHeight);
  const int x = kWidth / 2, y = kHeight / 2;
  EXPECT_NEAR(right.ab.At(0, y, x), key.At(1, y, x), 3.0f);
  EXPECT_NEAR(left.ab.At(0, y, x), key.At(1, y, x), 3.0f);
  EXPECT_NE(right.ab.data, left.ab.data);
}

TEST_F(AugmentationStageTest, ReportsMissingNovelViewsWithoutGeometry) {
  const auto facts = Run();
  EXPECT_EQ(facts.at("samples").size(), 5u);
  ASSERT_EQ(facts.at("left_out").size(), 1u);
  EXPECT_EQ(facts.at("left_out")[0].at("kind"), "novel_view");
  EXPECT_THAT(facts.at("left_out")[0].at("reason").get<std::string>(), HasSubstr("no luminance"));
}

TEST_F(AugmentationStageTest, MakesNothingIfKeyViewCoversTheScene) {
  AddInput(artifact::kCarryFacts, R"({"coverage": 0.95})");
  options_.novel_views = false;
  const auto facts = Run();
  EXPECT_THAT(Names(facts), ElementsAre("animate-1"));
  EXPECT_THAT(facts.at("left_out").dump(), AllOf(HasSubstr("95 %"), HasSubstr("not asked for")));
}

TEST_F(AugmentationStageTest, MakesNothingFromPartlyMaskedKeyView) {
  Write("m.png", EncodePng8(Image(kWidth, kHeight, 1, 1.0f)));
  scene_.views[1].mask_file = "m.png";
  AddInput(artifact::kScene, SceneToJson(scene_));
  const nlohmann::json facts = Run();
  EXPECT_TRUE(facts.at("samples").empty());
  EXPECT_THAT(facts.dump(), testing::HasSubstr("masked out"));
}

TEST_F(AugmentationStageTest, RefusesDamagedCarryFacts) {
  AddInput(artifact::kCarryFacts, R"({"coverage": "most"})");
  EXPECT_THAT(Complaint(), HasSubstr("carry.json is damaged"));
}

TEST_F(AugmentationStageTest, WritesNothingWithoutSamplesAndFiles) {
  options_.samples = 0;
  EXPECT_THAT(Names(Run()), IsEmpty());
  EXPECT_THAT(outputs_, ElementsAre("augmentations.json"));
  options_.samples = 65;
  EXPECT_THAT(Complaint(), HasSubstr("samples is 65"));
}

TEST_F(AugmentationStageTest, IsRepeatableForSameSeed) {
  AddGeometry();
  Run();
  std::map<std::string, std::string> first;
  for (const std::string& name : outputs_) first[name] = Output(name);
  Run();
  for (const std::string& name : outputs_) EXPECT_EQ(Output(name), first.at(name)) << name;
}

TEST_F(AugmentationStageTest, ReducesFilesToWorkingSize) {
  options_.samples = 0;
  options_.files = true;
  EXPECT_THAT(Complaint(), HasSubstr("no pictures in augment/"));
  Write("augment/sub/wide.jpg", EncodeJpeg(SrgbFromLab(Painting(300, 100))));
  Write("augment/a.png", EncodePng16(SrgbFromLab(Painting(64, 80))));
  const auto facts = Run();
  EXPECT_THAT(Names(facts), ElementsAre("file-1", "file-2"));
  EXPECT_EQ(facts.at("samples")[0].at("source"), "augment/a.png");
  EXPECT_EQ(facts.at("samples")[1].at("width"), kWidth);
  EXPECT_EQ(facts.at("samples")[1].at("height"), kWidth / 3);
  options_.files = false;
  EXPECT_THAT(Names(Run()), IsEmpty()) << "not requested";
}

TEST_F(AugmentationStageTest, NamesUnusableFiles) {
  options_.samples = 0;
  options_.files = true;
  const auto complaint = [&](const std::string& name, const std::string& bytes) {
    Write("augment/" + name, bytes);
    const std::string text = Complaint();
    EXPECT_EQ(code_, ErrorCode::kInvalidArgument);
    std::filesystem::remove_all(scratch_.path() / "scene/augment");
    return text;
  };
  EXPECT_THAT(complaint("notes.txt", "hello"),
              AllOf(HasSubstr("augment/notes.txt"), HasSubstr("no picture"), HasSubstr("remove")));
  EXPECT_THAT(complaint("broken.png", "no png at all"),
              AllOf(HasSubstr("augment/broken.png"), HasSubstr("remove")));
  Image grey = Painting(64, 64);
  std::fill_n(grey.Plane(1), 2 * grey.PlaneSize(), 0.0f);
  EXPECT_THAT(complaint("grey.png", EncodePng8(SrgbFromLab(grey))),
              AllOf(HasSubstr("augment/grey.png"), HasSubstr("no colour")));
  EXPECT_THAT(complaint("mono.png", EncodePng8(Image(64, 64, 1, 0.5f))),
              AllOf(HasSubstr("augment/mono.png"), HasSubstr("grey")));
  EXPECT_THAT(complaint("tiny.png", EncodePng8(SrgbFromLab(Painting(20, 64)))),
              AllOf(HasSubstr("20x64"), HasSubstr("at least 32 px")));
  for (int i = 0; i < 64; ++i) {
    Write("augment/" + std::to_string(i) + ".png", EncodePng8(SrgbFromLab(Painting(32, 32))));
  }
  EXPECT_THAT(complaint("last.png", EncodePng8(SrgbFromLab(Painting(32, 32)))),
              HasSubstr("more than 64"));
}

TEST_F(AugmentationStageTest, UsesGeneratorForClaimedKinds) {
  options_.backend = "mine";
  const auto facts = Run();
  EXPECT_THAT(FakeGenerator::requests, ElementsAre("outpaint 4"));
  EXPECT_GE(FakeGenerator::sent.width, kWidth);
  EXPECT_EQ(FakeGenerator::sent.channels, 3);
  EXPECT_EQ(facts.at("samples").size(), 5u);
  EXPECT_EQ(facts.at("samples")[0].at("source"), "backend mine");
  EXPECT_EQ(facts.at("samples")[0].at("width"), 80);
  EXPECT_EQ(facts.at("samples")[4].at("source"), "embedded");
}

TEST_F(AugmentationStageTest, RefusesBadAnswersOfGenerator) {
  options_.backend = "mine";
  FakeGenerator::answer = "nothing that is a picture";
  EXPECT_THAT(Complaint(), AllOf(HasSubstr("'mine'"), HasSubstr("outpaint")));
  EXPECT_EQ(code_, ErrorCode::kFailedPrecondition);
  FakeGenerator::answer = EncodePng8(Image(64, 64, 1, 0.5f));
  EXPECT_THAT(Complaint(), HasSubstr("grey"));
  FakeGenerator::info.capabilities = {capability::kAutomatic};
  EXPECT_THAT(Complaint(), HasSubstr("generates none"));
}

TEST_F(AugmentationStageTest, StopsWhenCancelled) {
  cancel_.Cancel();
  Complaint();
  EXPECT_EQ(code_, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace color3d
