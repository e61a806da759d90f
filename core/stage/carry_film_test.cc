// The stage carry_color on a film: results, resuming and returning shots.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/color/lab.h"
#include "core/keycolor/automatic/automatic.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
#include "tests/support/scenes/noise_place.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

constexpr int kWidth = 96, kHeight = 64, kFrames = 12, kKey = 5;

// Counts the frames, and cancels the work at one of them.
class FrameCounter : public NullObserver {
 public:
  void OnProgress(int64_t step, int64_t total, const std::string&) override {
    EXPECT_EQ(total, kFrames);
    steps.push_back(step);
    if (cancel != nullptr && step == cancel_at) cancel->Cancel();
  }
  std::vector<int64_t> steps;
  CancellationToken* cancel = nullptr;
  int64_t cancel_at = 0;
};

class CarryFilmTest : public StageTest {
 protected:
  CarryFilmTest() {
    for (int i = 0; i < kFrames; ++i) {
      Image gray(kWidth, kHeight, 1);
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          const double u = x + 1.2 * i;
          gray.At(0, y, x) = static_cast<float>(0.5 + 0.15 * std::sin(0.31 * u + 0.1 * y) +
                                                0.15 * std::sin(0.23 * y - 0.17 * u));
        }
      }
      View view;
      view.name = view.image_file = "f" + std::to_string(100 + i) + ".png";
      view.camera =
          view.captured_camera = {kWidth, kHeight, 100.0, 100.0, kWidth / 2.0, kHeight / 2.0};
      view.moment = Moment{0.04 * i, 0};
      WriteFileAtomic(scratch_.path() / view.image_file, EncodePng8(gray));
      scene_.views.push_back(view);
    }
    AddInput(artifact::kScene, SceneToJson(scene_));
    AddInput(artifact::kKeyView, R"({"view": ")" + scene_.views[kKey].name + R"("})");
    Image ab(kWidth, kHeight, 2);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        ab.At(0, y, x) = static_cast<float>(30.0 * std::sin(0.1 * x));
        ab.At(1, y, x) = static_cast<float>(30.0 * std::cos(0.1 * y));
      }
    }
    AddInput(artifact::kKeyColor, EncodeAbPng(ab));
  }

  nlohmann::json Run() {
    std::filesystem::remove_all(scratch_.path() / "out");
    std::filesystem::create_directories(scratch_.path() / "out");
    StageContext context({.scene_folder = scratch_.path(),
                          .inputs = inputs_,
                          .output_folder = scratch_.path() / "out",
                          .scratch_folder = scratch_.path(),
                          .threads = threads_},
                         *checkpoints_,
                         frames_,
                         cancel_);
    RunCarryColor({}, context);
    return nlohmann::json::parse(ReadFile(scratch_.path() / "out" / artifact::kCarryFacts));
  }
  std::vector<std::string> Carried() {
    std::vector<std::string> files;
    for (const View& view : scene_.views) {
      files.push_back(ReadFile(scratch_.path() / "out" / ViewArtifact(artifact::kCarried, view)));
    }
    return files;
  }

  Scene scene_;
  FrameCounter frames_;
  int threads_ = 1;
};

TEST_F(CarryFilmTest, ResumesWithTheSameResult) {
  const nlohmann::json facts = Run();
  EXPECT_GT(facts.at("coverage"), 0.5);
  const std::vector<std::string> files = Carried();
  EXPECT_EQ(frames_.steps.size(), static_cast<size_t>(kFrames));
  EXPECT_EQ(frames_.steps.back(), kFrames);
  for (const int threads : {1, 2}) {
    threads_ = threads;
    for (const size_t dies_at : {1u, 4u, 9u}) {
      DyingCheckpoints store;
      store.dies_at = dies_at;
      checkpoints_ = &store;
      EXPECT_THROW(Run(), Error);
      ASSERT_EQ(store.states.size(), dies_at);
      store.dies_at = 0;
      frames_.steps.clear();
      EXPECT_EQ(Run(), facts);
      EXPECT_EQ(frames_.steps.size(), kFrames - dies_at) << "no frame is carried into again";
      EXPECT_EQ(frames_.steps.front(), static_cast<int64_t>(dies_at + 1));
      EXPECT_EQ(Carried(), files) << threads << " threads, died at " << dies_at;
    }
  }
}

TEST_F(CarryFilmTest, IgnoresCheckpointOfOtherFilm) {
  const nlohmann::json facts = Run();
  DyingCheckpoints store;
  store.states = {"carry 3\nand then nonsense"};
  checkpoints_ = &store;
  EXPECT_EQ(Run(), facts);
}

TEST_F(CarryFilmTest, StopsBeforeNextFrameWhenCancelled) {
  frames_.cancel = &cancel_;
  frames_.cancel_at = 3;
  try {
    Run();
    FAIL() << "it continued";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kCancelled);
  }
  EXPECT_EQ(frames_.steps.back(), 3);
}

// A place, another place, and the first one again.
class ReturningShotTest : public StageTest {
 protected:
  static constexpr int kSideX = 176, kSideY = 132;

  ReturningShotTest() {
    for (int i = 0; i < kFrames; ++i) {
      const int shot = i / 4;
      View view;
      view.name = view.image_file = "f" + std::to_string(100 + i) + ".png";
      view.camera =
          view.captured_camera = {kSideX, kSideY, 100.0, 100.0, kSideX / 2.0, kSideY / 2.0};
      view.moment = Moment{0.04 * i, shot};
      WriteFileAtomic(scratch_.path() / view.image_file,
                      EncodePng8(NoisePlace(shot == 1 ? 2 : 1, kSideX, kSideY, 2 * i)));
      scene_.views.push_back(view);
    }
    AddInput(artifact::kScene, SceneToJson(scene_));
    AddInput(artifact::kKeyView, R"({"view": "f101.png"})");
    AddInput(artifact::kKeyColor, EncodeAbPng(Image(kSideX, kSideY, 2, 30.0f)));
  }
  std::string Run() {
    StageContext context = MakeContext();
    RunCarryColor({}, context);
    return ReadFile(scratch_.path() / "out" / artifact::kCarryFacts);
  }
  std::filesystem::path Carried(int frame) {
    return scratch_.path() / "out" / ViewArtifact(artifact::kCarried, scene_.views[frame]);
  }
  Scene scene_;
};

TEST_F(ReturningShotTest, TakesColorsOfTheFirstShot) {
  const std::string facts = Run();
  EXPECT_EQ(nlohmann::json::parse(facts).at("key_views"), nlohmann::json({"f101.png"}));
  std::vector<std::string> files;
  for (int i = 0; i < kFrames; ++i) {
    ASSERT_EQ(std::filesystem::exists(Carried(i)), i < 4 || i >= 8) << i;
    if (i < 8) continue;
    files.push_back(ReadFile(Carried(i)));
    const AbMap map = DecodeAbPng(files.back(), "carried");
    EXPECT_GT(map.confidence.At(0, kSideY / 2, kSideX / 2), 0.5f) << i;
    EXPECT_NEAR(map.ab.At(0, kSideY / 2, kSideX / 2), 30.0f, 0.1f) << i;
    EXPECT_LT(map.confidence.At(0, kSideY / 2, kSideX - 2), 0.5f) << "not in the key frame: " << i;
  }
  DyingCheckpoints store;
  store.dies_at = 7;
  checkpoints_ = &store;
  std::filesystem::remove_all(scratch_.path() / "out");
  EXPECT_THROW(Run(), Error);
  store.dies_at = 0;
  std::filesystem::remove_all(scratch_.path() / "out");
  EXPECT_EQ(Run(), facts);
  for (int i = 8; i < kFrames; ++i) EXPECT_EQ(ReadFile(Carried(i)), files[i - 8]) << i;
}

TEST_F(ReturningShotTest, OtherShotsGetAutomaticColorsWhereTheKeyViewHasThem) {
  const auto embedded = AutomaticColorizer::Embedded();
  AddInput(artifact::kKeyColorFacts,
           nlohmann::json{{"description", embedded->description()}}.dump());
  Run();
  const AbMap middle = DecodeAbPng(ReadFile(Carried(6)), "carried");
  const Image luminance = LuminanceFromSrgb(NoisePlace(2, kSideX, kSideY, 2 * 6));
  const AutomaticColor guess = embedded->Colorize(luminance);
  for (const int x : {20, 88, 150}) {
    EXPECT_NEAR(middle.ab.At(0, 66, x), guess.ab.At(0, 66, x), 2.0f);
    EXPECT_NEAR(middle.ab.At(1, 66, x), guess.ab.At(1, 66, x), 2.0f);
  }
  // A shot that returns has the key frame's colours.
  EXPECT_NEAR(DecodeAbPng(ReadFile(Carried(9)), "carried").ab.At(0, 66, 88), 30.0f, 0.1f);
  // Colours that somebody chose count for shots that return only.
  AddInput(artifact::kKeyColorFacts, R"({"source": "image"})");
  std::filesystem::remove_all(scratch_.path() / "out");
  Run();
  EXPECT_FALSE(std::filesystem::exists(Carried(6)));
}

}  // namespace
}  // namespace color3d
