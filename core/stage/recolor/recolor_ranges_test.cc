// The stage correct_colors on a film: key views that recolour a range of time.
#include "core/stage/recolor/recolor_ranges.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/color/lab.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/recolor/time_ranges.h"
#include "tests/support/scenes/wall_pan.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr int kWidth = 96, kHeight = 72, kFrames = 18, kKey = 7;

Scene FilmOf(int frames) {
  Scene scene;
  for (int i = 0; i < frames; ++i) {
    View view;
    view.name = view.image_file = fmt::format("f{:02}.png", i);
    view.camera =
        view.captured_camera = {kWidth, kHeight, 100.0, 100.0, kWidth / 2.0, kHeight / 2.0};
    view.moment = Moment{0.04 * i, 0};
    scene.views.push_back(view);
  }
  return scene;
}

RangeKeyView KeyOf(const std::string& view,
                   std::optional<double> begin_s,
                   std::optional<double> end_s) {
  return {view, begin_s, end_s};
}

class RecolorRangesTest : public StageTest {
 protected:
  // Colours the film.
  RecolorRangesTest() : scene_(FilmOf(kFrames)) {
    for (int i = 0; i < kFrames; ++i) {
      WriteFileAtomic(scratch_.path() / scene_.views[i].image_file,
                      EncodePng16(SrgbFromLab(WallPan(kWidth, kHeight, i))));
    }
    AddInput(artifact::kScene, SceneToJson(scene_));
    AddInput(artifact::kKeyView, fmt::format(R"({{"view": "f{:02}.png"}})", kKey));
    const Image truth = WallPan(kWidth, kHeight, kKey);
    Image ab(kWidth, kHeight, 2);
    std::copy_n(truth.Plane(1), ab.data.size(), ab.data.begin());
    AddInput(artifact::kKeyColor, EncodeAbPng(ab));
    RunForInputs([](StageContext& context) { RunCarryColor({}, context); });
    RunForInputs([](StageContext& context) { RunPersonalize({.iterations = 0}, context); });
    RunForInputs([](StageContext& context) { RunColorizeViews({.max_side_px = kWidth}, context); });
  }
  std::vector<std::string> Recolor(const std::vector<RangeKeyView>& keys) {
    return RunForInputs([&](StageContext& context) {
      RunCorrectColors({.ranges = keys, .proposals = 0}, context);
    });
  }
  // The frame painted in one other colour between two columns.
  std::filesystem::path PaintedFile(int view, float a = -25.0f, int from = 0, int to = kWidth) {
    Image lab = WallPan(kWidth, kHeight, view);
    std::fill_n(lab.Plane(1), lab.PlaneSize(), a);
    std::fill_n(lab.Plane(2), lab.PlaneSize(), -5.0f);
    const Image srgb = SrgbFromLab(lab);
    Image painted(kWidth, kHeight, 4);
    std::copy(srgb.data.begin(), srgb.data.end(), painted.data.begin());
    for (int y = 0; y < kHeight; ++y) {
      for (int x = from; x < to; ++x) painted.At(3, y, x) = 1.0f;
    }
    const auto file = scratch_.path() / fmt::format("painted{}_{}.png", view, from);
    WriteFileAtomic(file, EncodePng16(painted));
    return file;
  }
  RangeKeyView Painted(
      int view, double begin_s, double end_s, float a = -25.0f, int from = 0, int to = kWidth) {
    ColorizeKeyViewOptions key;
    key.view = scene_.views[view].name;
    key.file = PaintedFile(view, a, from, to);
    return KeyOf(AddKeyView(key), begin_s, end_s);
  }
  // Final colours of the film.
  std::vector<Image> Film() {
    const StageContext context = MakeContext();
    std::vector<Image> frames;
    for (int i = 0; i < kFrames; ++i) {
      frames.push_back(ReadTargetAb(context, scene_.views[i], i == kKey, kWidth, kHeight));
    }
    return frames;
  }
  Scene scene_;
};

double MeanOff(const Image& ab, float a, int from = 4, int to = kWidth - 4) {
  double sum = 0.0;
  for (int y = 4; y < kHeight - 4; ++y) {
    for (int x = from; x < to; ++x) sum += std::abs(ab.At(0, y, x) - a);
  }
  return sum / ((to - from) * (kHeight - 8));
}

TEST_F(RecolorRangesTest, ChangesFramesOfTheRangeOnly) {
  const std::vector<Image> before = Film();
  const auto left = Recolor({Painted(9, 0.24, 0.48)});
  EXPECT_EQ(left.size(), 2 * 7u + 1) << "colours and shares of seven frames";
  const std::vector<Image> after = Film();
  for (int i = 0; i < kFrames; ++i) {
    if (i < 6 || i > 12) {
      EXPECT_EQ(after[i].data, before[i].data) << i;
    } else {
      EXPECT_LT(MeanOff(after[i], -25.0f), 1.5) << i;
      EXPECT_GT(MeanOff(before[i], -25.0f), 15.0) << i;
    }
  }
  const StageContext context = MakeContext();
  const Image shares = ReadProvenance(context, scene_.views[10], kWidth, kHeight);
  EXPECT_GT(shares.At(1, kHeight / 2, kWidth / 2), 0.9f) << "seen in the key frame";
  const auto facts = ReadJson(context, artifact::kCorrections);
  EXPECT_EQ(
      facts.at("recolored").dump(),
      R"([{"view":"f09.png","first":"f06.png","last":"f12.png","begin_s":0.24,"end_s":0.48}])");
}

TEST_F(RecolorRangesTest, KeepsColorOfUnpaintedParts) {
  const std::vector<Image> before = Film();
  Recolor({Painted(9, 0.2, 0.48, -25.0f, 0, kWidth / 2)});
  const std::vector<Image> after = Film();
  for (const int i : {5, 8, 9, 12}) {
    EXPECT_LT(MeanOff(after[i], -25.0f, 6, kWidth / 2 - 8), 3.0) << i;
    double kept = 0.0;
    for (int y = 4; y < kHeight - 4; ++y) {
      kept += std::abs(after[i].At(0, y, 80) - before[i].At(0, y, 80));
    }
    EXPECT_LT(kept / (kHeight - 8), 3.0) << i;
  }
}

TEST_F(RecolorRangesTest, TakesSeveralRangesAndKeyViews) {
  Recolor({Painted(2, 0.08, 0.32), Painted(8, 0.08, 0.32, 25.0f), Painted(14, 0.56, 0.6, 12.0f)});
  const std::vector<Image> after = Film();
  const std::pair<int, float> expected[] = {{2, -25.0f}, {8, 25.0f}, {14, 12.0f}, {15, 12.0f}};
  for (const auto& [frame, a] : expected) EXPECT_LT(MeanOff(after[frame], a), 3.0) << frame;
  // Frames between them are no mean of both.
  EXPECT_LT(MeanOff(after[5], -25.0f), 5.0);
  EXPECT_LT(MeanOff(after[6], 25.0f), 5.0);
  EXPECT_GT(MeanOff(after[16], 12.0f), 4.0);
}

TEST_F(RecolorRangesTest, RefusesCorrectionsWithoutRangeBesideThem) {
  CorrectColorsOptions options{.ranges = {KeyOf("f09.png", 0.24, 0.48)}};
  EXPECT_NO_THROW(options.Validate());
  options.corrections = {{"f03.png", {}}};
  try {
    options.Validate();
    FAIL() << "it was accepted";
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("f03.png has no range of time"));
  }
}

// The colours of proposed views are computed again, which bounds memory.
TEST_F(RecolorRangesTest, PicturesToPaintOnHaveCorrectedColors) {
  const PaintedColors colors{PaintedColors::Kind::kPicture, PaintedFile(9, -25.0f, 0, kWidth / 2)};
  RunForInputs([&](StageContext& context) {
    RunCorrectColors({.corrections = {{"f09.png", colors}}, .proposals = 3}, context);
  });
  const std::vector<Image> after = Film();
  const StageContext context = MakeContext();
  const auto places = ReadJson(context, artifact::kCorrections).at("proposals");
  ASSERT_FALSE(places.empty());
  for (const auto& place : places) {
    const int index = scene_.FindView(place.at("view").get<std::string>());
    const std::string name = ViewArtifact(artifact::kPaint, scene_.views[index]);
    const Image painted = LabFromSrgb(DecodeImage(context.ReadInput(name), name));
    double error = 0.0;
    for (size_t i = 0; i < after[index].data.size(); ++i) {
      error += std::abs(painted.Plane(1)[i] - after[index].data[i]);
    }
    EXPECT_LT(error / static_cast<double>(after[index].data.size()), 1.0) << name;
  }
}

std::string Complaint(const std::vector<RangeKeyView>& keys, const Scene& scene) {
  try {
    RangesOf(keys, scene);
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
    return e.what();
  }
  return "nothing";
}

TEST(RangesOfTest, AreFramesOfTheShotWithinTheTime) {
  Scene scene = FilmOf(10);
  for (int i = 6; i < 10; ++i) scene.views[i].moment->shot = 1;
  const auto views = [&](const RangeKeyView& key) { return RangesOf({key}, scene)[0].views; };
  EXPECT_THAT(views(KeyOf("f04.png", 0.12, 0.32)), ElementsAre(3, 4, 5)) << "up to the cut";
  EXPECT_THAT(views(KeyOf("f08", 0.32, {})), ElementsAre(8, 9)) << "to the end";
  EXPECT_THAT(views(KeyOf("f02", {}, 0.1)), ElementsAre(0, 1, 2)) << "from the beginning";
  EXPECT_THAT(views(KeyOf("f08", 0.0, 0.4)), ElementsAre(6, 7, 8, 9)) << "all that is shown";
  const auto two = RangesOf({KeyOf("f04", 0.12, 0.2), KeyOf("f05", 0.115, 0.21)}, scene);
  ASSERT_EQ(two.size(), 1u) << "the same frames";
  EXPECT_EQ(two[0].keys[1].view, 5);
  EXPECT_EQ(RangesOf({KeyOf("f04", 0.12, 0.4), KeyOf("f08", 0.12, 0.4)}, scene).size(), 2u);
}

TEST(RangesOfTest, RefusesImpossibleRanges) {
  Scene scene = FilmOf(10);
  EXPECT_THAT(Complaint({KeyOf("f04", 0.2, 0.1)}, scene), HasSubstr("before it begins at 0.2 s"));
  for (const auto& [begin_s, end_s] :
       {std::pair{0.1, 14.5}, {-0.1, 0.3}, {7.0, 9.0}, {-3.0, -1.0}}) {
    EXPECT_THAT(Complaint({KeyOf("f04", begin_s, end_s)}, scene),
                HasSubstr("reaches out of the film, which is coloured from 0.000 s to 0.400 s"));
  }
  EXPECT_THAT(Complaint({KeyOf("f04", 7.0, {})}, scene), HasSubstr("from 7 s to the end, reaches"));
  EXPECT_THAT(Complaint({KeyOf("f04", 0.2, 0.3)}, scene),
              HasSubstr("f04.png is shown at 0.160 s, outside of its range, from 0.2 s to 0.3 s"));
  EXPECT_THAT(Complaint({KeyOf("f04", 0.1, 0.2), KeyOf("f07", 0.2, 0.3)}, scene),
              HasSubstr("f04.png and f07.png share some frames"));
  EXPECT_THAT(Complaint({KeyOf("f04", 0.1, 0.2), KeyOf("f04.png", 0.1, 0.2)}, scene),
              HasSubstr("given twice"));
  scene.views[4].held_out = true;
  EXPECT_THAT(Complaint({KeyOf("f04", 0.1, 0.2)}, scene), HasSubstr("held out"));
  for (int i = 0; i < 10; ++i) scene.views[i].cam_from_world.translation = {0.1 * i, 0.0, 0.0};
  EXPECT_THAT(Complaint({KeyOf("f03", 0.1, 0.2)}, scene), HasSubstr("has poses"));
  for (View& view : scene.views) view.moment.reset();
  EXPECT_THAT(Complaint({KeyOf("f03", 0.1, 0.2)}, scene), HasSubstr("is not a film"));
}

}  // namespace
}  // namespace color3d
