// The stage generate_augmentations: the user's files, a generator of the user's, our surrogates.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "core/base/files.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/image/codec.h"
#include "core/stage/artifacts.h"
#include "core/stage/stages.h"

namespace color3d {
namespace {
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr int kWidth = 96, kHeight = 72;

// Stripes and a slope, in colour.
Image Painting(int width, int height) {
  Image lab(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      lab.At(0, y, x) = 30.0f + 40.0f * x / width + 10.0f * std::sin(0.3f * y);
      lab.At(1, y, x) = 25.0f * std::sin(0.2f * x);
      lab.At(2, y, x) = 20.0f;
    }
  }
  return lab;
}

class FakeGenerator : public RemoteColorizer {
 public:
  RemoteInfo GetInfo(ProgressObserver&, const CancellationToken&) override { return info; }
  std::string Colorize(const RemoteRequest&, ProgressObserver&, const CancellationToken&) override {
    return "";
  }
  std::vector<std::string> Generate(const RemoteGenerateRequest& request,
                                    ProgressObserver&,
                                    const CancellationToken&) override {
    sent = DecodeImage(request.image_png, "sent");
    requests.push_back(request.kind + " " + std::to_string(request.samples));
    return std::vector<std::string>(static_cast<size_t>(answers), answer);
  }
  inline static RemoteInfo info;
  inline static Image sent;
  inline static std::vector<std::string> requests;
  inline static int answers = 4;
  inline static std::string answer;
};

class AugmentationStageTest : public ::testing::Test {
 protected:
  AugmentationStageTest() {
    const Image lab = Painting(kWidth, kHeight);
    Image gray(kWidth, kHeight, 1);
    for (size_t i = 0; i < gray.PlaneSize(); ++i) {
      gray.data[i] = static_cast<float>(GrayFromLuminance(lab.Plane(0)[i]));
    }
    for (int i = 0; i < 3; ++i) {
      View view;
      view.name = view.image_file = "p" + std::to_string(i) + ".png";
      view.camera = {kWidth, kHeight, 80.0, 80.0, kWidth / 2.0, kHeight / 2.0};
      view.captured_camera = view.camera;
      view.cam_from_world.translation = {0.5 * (1 - i), 0.0, 0.0};
      Write(view.name, EncodePng16(gray));
      scene_.views.push_back(view);
    }
    AddInput(artifact::kScene, SceneToJson(scene_));
    AddInput(artifact::kKeyView, R"({"view": "p1.png"})");
    AddInput(artifact::kKeyColor, EncodeAbPng(ChromaOfLab(lab)));
    options_.max_side_px = kWidth;
    FakeGenerator::info = {"generator 1", {capability::kOutpaint}, 0, true};
    FakeGenerator::requests.clear();
    FakeGenerator::answers = 4;
    FakeGenerator::answer = EncodePng8(SrgbFromLab(Painting(80, 64)));
  }
  void Write(const std::string& name, const std::string& bytes) {
    std::filesystem::create_directories((scratch_.path() / "scene" / name).parent_path());
    WriteFileAtomic(scratch_.path() / "scene" / name, bytes);
  }
  void AddInput(const std::string& name, const std::string& bytes) {
    const auto path = scratch_.path() / ("in" + std::to_string(added_++));
    WriteFileAtomic(path, bytes);
    inputs_[name] = path;
  }
  // A wall of Gaussians at depth 4, larger than all views see.
  void AddGeometry() {
    GaussianModel model;
    for (int y = -30; y <= 30; ++y) {
      for (int x = -40; x <= 40; ++x) {
        model.position.insert(model.position.end(), {0.15f * x, 0.15f * y, 4.0f});
        model.log_scale.insert(model.log_scale.end(), 3, std::log(0.12f));
        model.rotation.insert(model.rotation.end(), {1.0f, 0.0f, 0.0f, 0.0f});
        model.opacity_logit.push_back(4.0f);
        model.sh_l.push_back(0.0f);
      }
    }
    AddInput(artifact::kGeometry, SerializeGaussians(model));
  }
  nlohmann::json Run() {
    std::filesystem::remove_all(scratch_.path() / "out");
    std::filesystem::create_directories(scratch_.path() / "out");
    StageContext::Setup setup;
    setup.scene_folder = scratch_.path() / "scene";
    setup.inputs = inputs_;
    setup.output_folder = scratch_.path() / "out";
    setup.scratch_folder = scratch_.path();
    setup.remote_colorizers = [](const std::string&) { return std::make_unique<FakeGenerator>(); };
    StageContext context(setup, none_, observer_, cancel_);
    RunGenerateAugmentations(options_, context);
    outputs_ = context.outputs();
    return nlohmann::json::parse(Output("augmentations.json"));
  }
  std::string Output(const std::string& name) { return ReadFile(scratch_.path() / "out" / name); }
  static std::vector<std::string> Names(const nlohmann::json& facts) {
    std::vector<std::string> names;
    for (const auto& sample : facts.at("samples")) names.push_back(sample.at("name"));
    return names;
  }
  std::string Complaint() {
    try {
      Run();
    } catch (const Error& e) {
      code_ = e.code();
      return e.what();
    }
    return "nothing";
  }

  ScratchFolder scratch_;
  Scene scene_;
  std::map<std::string, std::filesystem::path> inputs_;
  AugmentationOptions options_;
  NoCheckpoints none_;
  NullObserver observer_;
  CancellationToken cancel_;
  std::vector<std::string> outputs_;
  int added_ = 0;
  ErrorCode code_ = ErrorCode::kInternal;
};

TEST_F(AugmentationStageTest, EightPicturesAreMadeWithGeometry) {
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
      ASSERT_NEAR(ab.ab.Plane(1)[i], 20.0f, 3.0f) << name << ": a colour of nowhere";
    }
    EXPECT_GT(weighed, kWidth * kHeight / 2) << name;
  }
  EXPECT_EQ(DecodeImage(Output("augmentations.jpg"), "sheet").channels, 3);
}

TEST_F(AugmentationStageTest, ANovelViewShiftsTheWallAsItsCameraDoes) {
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

TEST_F(AugmentationStageTest, WithoutGeometryThereAreNoNovelViewsAndTheReasonIsSaid) {
  const auto facts = Run();
  EXPECT_EQ(facts.at("samples").size(), 5u);
  ASSERT_EQ(facts.at("left_out").size(), 1u);
  EXPECT_EQ(facts.at("left_out")[0].at("kind"), "novel_view");
  EXPECT_THAT(facts.at("left_out")[0].at("reason").get<std::string>(), HasSubstr("no luminance"));
}

TEST_F(AugmentationStageTest, NothingIsInventedAroundAKeyViewThatCoversTheScene) {
  AddInput(artifact::kCarryFacts, R"({"coverage": 0.95})");
  options_.novel_views = false;
  const auto facts = Run();
  EXPECT_THAT(Names(facts), ElementsAre("animate-1"));
  EXPECT_THAT(facts.at("left_out").dump(), AllOf(HasSubstr("95 %"), HasSubstr("not asked for")));
}

TEST_F(AugmentationStageTest, DamagedFactsOfTheCarryAreRefused) {
  AddInput(artifact::kCarryFacts, R"({"coverage": "most"})");
  EXPECT_THAT(Complaint(), HasSubstr("carry.json is damaged"));
}

TEST_F(AugmentationStageTest, NoSamplesAndNoFilesLeaveNothing) {
  options_.samples = 0;
  EXPECT_THAT(Names(Run()), IsEmpty());
  EXPECT_THAT(outputs_, ElementsAre("augmentations.json"));
  options_.samples = 65;
  EXPECT_THAT(Complaint(), HasSubstr("samples is 65"));
}

TEST_F(AugmentationStageTest, TheSameSeedGivesTheSameBytes) {
  AddGeometry();
  Run();
  std::map<std::string, std::string> first;
  for (const std::string& name : outputs_) first[name] = Output(name);
  Run();
  for (const std::string& name : outputs_) EXPECT_EQ(Output(name), first.at(name)) << name;
}

TEST_F(AugmentationStageTest, TheUsersOwnPicturesAreTakenAtWorkingSize) {
  options_.samples = 0;
  Write("augment/sub/wide.jpg", EncodeJpeg(SrgbFromLab(Painting(300, 100))));
  Write("augment/a.png", EncodePng16(SrgbFromLab(Painting(64, 80))));
  const auto facts = Run();
  EXPECT_THAT(Names(facts), ElementsAre("file-1", "file-2"));
  EXPECT_EQ(facts.at("samples")[0].at("source"), "augment/a.png");
  EXPECT_EQ(facts.at("samples")[1].at("width"), kWidth);
  EXPECT_EQ(facts.at("samples")[1].at("height"), kWidth / 3);
}

TEST_F(AugmentationStageTest, FilesThatDoNotBelongInAugmentAreRefusedByName) {
  options_.samples = 0;
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

TEST_F(AugmentationStageTest, AGeneratorMakesWhatItClaimsAndTheRestIsOurs) {
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

TEST_F(AugmentationStageTest, BadAnswersOfAGeneratorAreRefused) {
  options_.backend = "mine";
  FakeGenerator::answer = "nothing that is a picture";
  EXPECT_THAT(Complaint(), AllOf(HasSubstr("'mine'"), HasSubstr("outpaint")));
  EXPECT_EQ(code_, ErrorCode::kFailedPrecondition);
  FakeGenerator::answer = EncodePng8(Image(64, 64, 1, 0.5f));
  EXPECT_THAT(Complaint(), HasSubstr("grey"));
  FakeGenerator::info.capabilities = {capability::kAutomatic};
  EXPECT_THAT(Complaint(), HasSubstr("generates none"));
}

class PersonalizeStageTest : public AugmentationStageTest {
 protected:
  std::string Personalize() {
    StageContext::Setup setup;
    setup.scene_folder = scratch_.path() / "scene";
    setup.inputs = inputs_;
    setup.output_folder = scratch_.path() / "out";
    std::filesystem::create_directories(setup.output_folder);
    StageContext context(setup, none_, warnings_, cancel_);
    ColorizerOptions options;
    options.iterations = 2;
    options.crop_px = options.max_side_px = 64;
    RunPersonalize(options, context);
    return Output(artifact::kColorizer);
  }
  struct Warnings : NullObserver {
    void OnWarning(const std::string& message) override { text += message; }
    std::string text;
  };
  Warnings warnings_;
};

TEST_F(PersonalizeStageTest, AKeyViewWithoutColourIsSaid) {
  Personalize();
  EXPECT_EQ(warnings_.text, "");
  AddInput(artifact::kKeyColor, EncodeAbPng(Image(kWidth, kHeight, 2, 0.3f)));
  Personalize();
  EXPECT_THAT(warnings_.text, AllOf(HasSubstr("hardly any colour"), HasSubstr("hints")));
}

TEST_F(PersonalizeStageTest, AKeyColourOfAnotherShapeIsRefused) {
  AddInput(artifact::kKeyColor, EncodeAbPng(Image(kHeight, kWidth, 2, 30.0f)));
  try {
    Personalize();
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
    EXPECT_THAT(e.what(), AllOf(HasSubstr("72x96"), HasSubstr("64x48")));
  }
  AddInput(artifact::kKeyColor, EncodeAbPng(Image(2 * kWidth, 2 * kHeight, 2, 30.0f)));
  EXPECT_FALSE(Personalize().empty()) << "another size of the same shape will do";
}

TEST_F(PersonalizeStageTest, GeneratedPicturesAreLearntFrom) {
  const Image luminance = LuminanceOfLab(Painting(kWidth, kHeight));
  const auto colors = [&] {
    return LoadColorizer(Personalize(), Encoder::Embedded(), 1)->Colorize(luminance).data;
  };
  const std::vector<float> alone = colors();
  Run();
  for (const std::string& name : outputs_) AddInput(name, Output(name));
  EXPECT_NE(colors(), alone);
  AddInput(artifact::kAugmentationFacts, R"({"samples": []})");
  EXPECT_EQ(colors(), alone);
  AddInput(artifact::kAugmentationFacts, "[1]");
  EXPECT_THROW(Personalize(), Error);
}

TEST_F(AugmentationStageTest, EndsWhenItIsCancelled) {
  cancel_.Cancel();
  Complaint();
  EXPECT_EQ(code_, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace color3d
