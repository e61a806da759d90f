// The stage carry_color on a painted wall of known geometry, and ViewPositions.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/color/lab.h"
#include "core/splat/raster/render.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
#include "core/stage/sources/view_positions.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {
using ::testing::HasSubstr;
using ::testing::Not;

constexpr int kWidth = 128, kHeight = 96;
constexpr double kFocal = 110.0, kDepth = 4.0;

LabColor Wall(double x, double y) {
  const double l = 50.0 + 12.0 * std::sin(4.0 * x + y) + 10.0 * std::sin(9.0 * y - 2.0 * x) +
                   8.0 * std::sin(17.0 * x) * std::cos(13.0 * y);
  return {l, 35.0 * std::sin(0.8 * x), 20.0 * std::cos(0.7 * y)};
}

float MaxOf(const Image& image) { return *std::ranges::max_element(image.data); }

class CarryStageTest : public StageTest {
 protected:
  // Five cameras along the wall, each half a picture further; the first one is held out.
  CarryStageTest() {
    for (int i = 0; i < 5; ++i) {
      const double at = 1.2 * i;
      Image lab(kWidth, kHeight, 3);
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          const LabColor color = Wall(at + kDepth * (x + 0.5 - kWidth / 2.0) / kFocal,
                                      kDepth * (y + 0.5 - kHeight / 2.0) / kFocal);
          lab.At(0, y, x) = static_cast<float>(color.l);
          lab.At(1, y, x) = static_cast<float>(color.a);
          lab.At(2, y, x) = static_cast<float>(color.b);
        }
      }
      truth_.push_back(lab);
      View view;
      view.name = view.image_file = "p" + std::to_string(i) + ".png";
      view.camera = {kWidth, kHeight, kFocal, kFocal, kWidth / 2.0, kHeight / 2.0};
      view.captured_camera = view.camera;
      view.cam_from_world.translation = {-at, 0.0, 0.0};
      view.held_out = i == 0;
      WriteFileAtomic(scratch_.path() / view.image_file, EncodePng16(SrgbFromLab(lab)));
      scene_.views.push_back(view);
    }
    GaussianModel model;
    for (int y = -20; y <= 20; ++y) {
      for (int x = -30; x <= 70; ++x) {
        model.position.insert(model.position.end(), {0.12f * x, 0.12f * y, 4.0f});
        model.log_scale.insert(model.log_scale.end(), 3, std::log(0.08f));
        model.rotation.insert(model.rotation.end(), {1.0f, 0.0f, 0.0f, 0.0f});
        model.opacity_logit.push_back(4.0f);
        model.sh_l.push_back(0.0f);
      }
    }
    AddInput(artifact::kScene, SceneToJson(scene_));
    AddInput(artifact::kKeyView, R"({"view": "p1.png"})");
    Image ab(kWidth, kHeight, 2);
    std::copy_n(truth_[1].Plane(1), ab.data.size(), ab.data.begin());
    AddInput(artifact::kKeyColor, EncodeAbPng(ab));
    AddInput(artifact::kGeometry, SerializeGaussians(model));
    options_.depth_side_px = kWidth;
  }

  nlohmann::json Run() {
    StageContext context = MakeContext();
    RunCarryColor(options_, context);
    return nlohmann::json::parse(ReadFile(scratch_.path() / "out" / artifact::kCarryFacts));
  }
  AbMap Carried(int view) {
    const std::string name = ViewArtifact(artifact::kCarried, scene_.views[view]);
    return DecodeAbPng(ReadFile(scratch_.path() / "out" / name), name);
  }
  std::string Complaint() {
    try {
      Run();
    } catch (const Error& e) {
      return e.what();
    }
    return "nothing";
  }
  std::string AddKeyViewIn(int view, const Image& srgb) {
    ColorizeKeyViewOptions key;
    key.view = scene_.views[view].name;
    key.file = scratch_.path() / ("key" + std::to_string(view) + ".png");
    WriteFileAtomic(key.file, EncodePng16(srgb));
    return AddKeyView(key);
  }

  Scene scene_;
  std::vector<Image> truth_;
  CarryColorOptions options_;
};

TEST_F(CarryStageTest, CarriesKeyViewIntoEveryView) {
  const nlohmann::json facts = Run();
  // Neighbours share about 74 % of the key view's width, the next ones 48 % and 22 %.
  const double expected[] = {0.74, 1.0, 0.74, 0.48, 0.22};
  for (int i = 0; i < 5; ++i) {
    EXPECT_NEAR(facts["views"][i]["coverage"], expected[i], 0.08) << i;
    const AbMap map = Carried(i);
    double error = 0.0;
    int count = 0;
    for (size_t p = 0; p < map.confidence.data.size(); ++p) {
      if (map.confidence.data[p] < 0.5f) continue;
      error += std::abs(map.ab.Plane(0)[p] - truth_[i].Plane(1)[p]);
      ++count;
    }
    ASSERT_GT(count, 500) << i;
    EXPECT_LT(error / count, 0.8) << i;
  }
  EXPECT_EQ(facts["key_views"], nlohmann::json({"p1.png"}));
  EXPECT_EQ(observer_.text, "");
}

TEST_F(CarryStageTest, CarriesNothingIfViewsAgreeTooLittle) {
  Run();
  std::vector<Agreement> agreements;
  for (const int other : {0, 2, 3, 4}) agreements.push_back(AgreementOf(Carried(other).confidence));
  const double agreement = MeanAgreement(agreements);
  EXPECT_GT(agreement, 0.8) << "the geometry is right";
  options_.min_agreement = agreement - 1e-4;
  EXPECT_GT(Run()["coverage"], 0.4);
  EXPECT_EQ(observer_.text, "");
  options_.min_agreement = agreement + 1e-4;
  const nlohmann::json facts = Run();
  EXPECT_EQ(facts["coverage"], 0.0);
  EXPECT_EQ(facts["views"][1]["coverage"], 1.0) << "the key view";
  for (const int other : {0, 2, 3, 4}) EXPECT_EQ(MaxOf(Carried(other).confidence), 0.0f) << other;
  EXPECT_EQ(MaxOf(Carried(1).confidence), 1.0f);
  EXPECT_THAT(observer_.text, HasSubstr("the photos agree by only"));
  EXPECT_THAT(observer_.text, Not(HasSubstr("the key view shows only")));
}

TEST_F(CarryStageTest, CarriesStaticFilmLikePhotos) {
  Run();
  std::vector<Image> of_photos;
  for (int i = 0; i < 5; ++i) of_photos.push_back(Carried(i).ab);
  for (int i = 0; i < 5; ++i) scene_.views[i].moment = Moment{0.1 * i, 0};
  AddInput(artifact::kScene, SceneToJson(scene_));
  Run();
  for (int i = 0; i < 5; ++i) EXPECT_EQ(Carried(i).ab.data, of_photos[i].data) << i;
}

TEST_F(CarryStageTest, CarriesNothingFromOrToMaskedPixels) {
  Image mask(kWidth, kHeight, 1, 1.0f);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth / 2; ++x) mask.At(0, y, x) = 0.0f;
  }
  WriteFileAtomic(scratch_.path() / "m.png", EncodePng8(mask));
  const auto carried_of_half = [](const AbMap& map, int first) {
    double sum = 0.0;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = first; x < first + kWidth / 2; ++x) sum += map.confidence.At(0, y, x);
    }
    return sum / (kHeight * kWidth / 2);
  };
  Run();
  const double right_of_next = carried_of_half(Carried(2), kWidth / 2);
  EXPECT_GT(carried_of_half(Carried(2), 0), 0.8);
  EXPECT_GT(carried_of_half(Carried(0), kWidth / 2), 0.8);
  scene_.views[1].mask_file = scene_.views[2].mask_file = "m.png";
  AddInput(artifact::kScene, SceneToJson(scene_));
  Run();
  EXPECT_LT(carried_of_half(Carried(1), 0), 1e-6) << "the key view itself";
  EXPECT_GT(carried_of_half(Carried(1), kWidth / 2), 0.9);
  EXPECT_LT(carried_of_half(Carried(2), 0), 1e-6) << "to it";
  EXPECT_NEAR(carried_of_half(Carried(2), kWidth / 2), right_of_next, 0.02);
  // The first photo overlaps mostly with the masked half of the key view.
  EXPECT_LT(carried_of_half(Carried(0), kWidth / 2), 0.6) << "from it";
}

TEST_F(CarryStageTest, AdditionalKeyViewFillsWhatIsOpen) {
  // A second key view in another colour: it may colour only what the first one does not show.
  Image other = truth_[4];
  for (size_t i = 0; i < other.PlaneSize(); ++i) {
    other.Plane(1)[i] = -20.0f;
    other.Plane(2)[i] = 0.0f;
  }
  options_.additional_key_views = {AddKeyViewIn(4, SrgbFromLab(other))};
  const nlohmann::json facts = Run();
  EXPECT_EQ(facts["key_views"], nlohmann::json({"p1.png", "p4.png"}));
  EXPECT_GT(facts["views"][3]["coverage"], 0.85);
  const AbMap second = Carried(4);
  int kept = 0, filled = 0;
  for (int y = 10; y < kHeight - 10; ++y) {
    // The left end of the fifth picture is seen by the first key view; the right one is not.
    kept += std::abs(second.ab.At(0, y, 12) - truth_[4].At(1, y, 12)) < 8.0f;
    filled += std::abs(second.ab.At(0, y, 110) + 20.0f) < 3.0f;
  }
  EXPECT_GT(kept, 60);
  EXPECT_GT(filled, 70);
}

TEST_F(CarryStageTest, RefusesUnfitAdditionalKeyViews) {
  const auto complaint = [&](const std::string& view) {
    options_.additional_key_views = {view};
    return Complaint();
  };
  EXPECT_THAT(complaint("p0.png"), HasSubstr("held out"));
  EXPECT_THAT(complaint("p1"), HasSubstr("key view already"));
  EXPECT_THAT(complaint("nowhere.png"), HasSubstr("nowhere.png"));
  EXPECT_THAT(complaint("p3.png"),
              HasSubstr("colours of the additional key view p3.png are missing"));
  options_.additional_key_views.assign(17, "p3.png");
  EXPECT_THAT(Complaint(), HasSubstr("at most 16"));
}

TEST_F(CarryStageTest, WarnsWhenKeyViewOverlapsWithNoOther) {
  scene_.views[1].cam_from_world.translation = {40.0, 0.0, 0.0};
  AddInput(artifact::kScene, SceneToJson(scene_));
  const nlohmann::json facts = Run();
  EXPECT_LT(facts["coverage"], 0.01);
  EXPECT_THAT(observer_.text, HasSubstr("0.0 % of what the other views show"));
}

TEST_F(CarryStageTest, GivesTheSameBytesAgain) {
  Run();
  const std::string first = ReadFile(scratch_.path() / "out" / "carried/p2.png");
  Run();
  EXPECT_EQ(first, ReadFile(scratch_.path() / "out" / "carried/p2.png"));
}

// Keeps every saved state, and loses the lease at the third.
class Dying : public CheckpointStore {
 public:
  std::optional<std::string> Load() override {
    return states.empty() ? std::nullopt : std::optional(states.back());
  }
  bool WantsSave() override { return true; }
  void Save(const std::string& state) override {
    states.push_back(state);
    if (states.size() == 3) throw Error(ErrorCode::kAborted, "the lease is lost");
  }
  std::vector<std::string> states;
};

TEST_F(CarryStageTest, ResumesWithTheSameResult) {
  const nlohmann::json facts = Run();
  std::vector<std::string> files;
  const auto file = [&](int i) {
    return scratch_.path() / "out" / ViewArtifact(artifact::kCarried, scene_.views[i]);
  };
  for (int i = 0; i < 5; ++i) {
    files.push_back(ReadFile(file(i)));
    std::filesystem::remove(file(i));
  }
  Dying store;
  checkpoints_ = &store;
  EXPECT_THAT(Complaint(), HasSubstr("lease"));
  EXPECT_EQ(Run(), facts);
  EXPECT_EQ(store.states.size(), 5u) << "three views before, two after";
  for (int i = 0; i < 5; ++i) EXPECT_EQ(ReadFile(file(i)), files[i]) << i;
}

TEST_F(CarryStageTest, IgnoresDamagedCheckpointWithWarning) {
  const nlohmann::json facts = Run();
  // No CBOR; a view whose value is a number; nothing at all.
  for (const char* state : {"nonsense", "\xa1\x66p2.png\x01", ""}) {
    Dying store;
    store.states = {"", "", "", state};
    checkpoints_ = &store;
    observer_.text.clear();
    EXPECT_EQ(Run(), facts);
    EXPECT_THAT(observer_.text, HasSubstr("starts afresh"));
  }
}

// A place on the wall has the same position in all views.
TEST_F(CarryStageTest, PositionsAgreeBetweenViews) {
  const StageContext context = MakeContext();
  const ViewPositions positions(scene_, context);
  const Camera& camera = scene_.views[1].camera;
  const auto shown = [&](int view) {
    ThreadPool pool(1);
    const GaussianModel wall = ParseGaussians(context.ReadInput(artifact::kGeometry));
    return RenderView(wall, camera, scene_.views[view].cam_from_world, pool).lab;
  };
  const Image first = positions.Of(1, camera, shown(1), nullptr),
              second = positions.Of(2, camera, shown(2), nullptr);
  ASSERT_EQ(first.channels, 4);
  const int shift = static_cast<int>(std::lround(1.2 * kFocal / kDepth));  // px
  for (int y = 20; y < kHeight - 20; y += 10) {
    for (int x = shift + 10; x < kWidth - 10; x += 10) {
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(first.At(c, y, x), second.At(c, y, x - shift), 0.02) << x << " " << y;
      }
      EXPECT_EQ(first.At(3, y, x), 1.0f);
    }
  }
  // Columns of Gaussians reach from -3.6 to 8.4, rows from -2.4 to 2.4: bounded, and not small.
  EXPECT_GT(std::abs(first.At(0, 48, 100) - first.At(0, 48, 10)), 0.3f);
  for (float value : first.data) EXPECT_LE(std::abs(value), 3.0f);
  // A photo that shows something else in its left half.
  Image other = shown(1);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth / 2; ++x) other.At(0, y, x) += 40.0f;
  }
  const Image half = positions.Of(1, camera, other, nullptr);
  Image mask(camera.width, camera.height, 1, 1.0f);
  mask.At(0, 20, 30) = 0.0f;
  const Image masked = positions.Of(1, camera, shown(1), &mask);
  EXPECT_EQ(first.At(3, 20, 30), 1.0f);
  EXPECT_EQ(masked.At(3, 20, 30), 0.0f);
  EXPECT_EQ(masked.At(3, 20, 31), first.At(3, 20, 31));
  for (int c = 0; c < 4; ++c) EXPECT_EQ(half.At(c, kHeight / 2, kWidth / 4), 0.0f);
  EXPECT_EQ(half.At(3, kHeight / 2, 3 * kWidth / 4), 1.0f);
}

TEST_F(CarryStageTest, PositionsAreUnknownWithoutGeometry) {
  inputs_.erase(artifact::kGeometry);
  const StageContext context = MakeContext();
  EXPECT_TRUE(ViewPositions(scene_, context)
                  .Of(1, scene_.views[1].camera, Image(kWidth, kHeight, 1), nullptr)
                  .Empty());
}

}  // namespace
}  // namespace color3d
