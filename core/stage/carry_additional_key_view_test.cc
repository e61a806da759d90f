// The stage carry_color on a film with an additional key view.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/color/lab.h"
#include "core/scene/view_images.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/key_views.h"
#include "core/stage/run_stages.h"
#include "tests/support/scenes/wall_pan.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

constexpr int kWidth = 96, kHeight = 72, kFrames = 16;

class AdditionalKeyFrameTest : public StageTest {
 protected:
  AdditionalKeyFrameTest() {
    for (int i = 0; i < kFrames; ++i) {
      View view;
      view.name = view.image_file = fmt::format("f{:02}.png", i);
      view.camera =
          view.captured_camera = {kWidth, kHeight, 100.0, 100.0, kWidth / 2.0, kHeight / 2.0};
      view.moment = Moment{0.04 * i, 0};
      WriteFileAtomic(scratch_.path() / view.image_file,
                      EncodePng16(SrgbFromLab(WallPan(kWidth, kHeight, i))));
      scene_.views.push_back(view);
    }
    AddInput(artifact::kScene, SceneToJson(scene_));
    AddInput(artifact::kKeyView, R"({"view": "f02.png"})");
    const Image truth = WallPan(kWidth, kHeight, 2);
    Image ab(kWidth, kHeight, 2);
    std::copy_n(truth.Plane(1), ab.data.size(), ab.data.begin());
    AddInput(artifact::kKeyColor, EncodeAbPng(ab));
  }
  // Carries, and returns the files of all frames.
  std::vector<std::string> Run(const CarryColorOptions& options) {
    StageContext context = MakeContext();
    RunCarryColor(options, context);
    std::vector<std::string> files;
    for (const View& view : scene_.views) {
      files.push_back(ReadFile(scratch_.path() / "out" / ViewArtifact(artifact::kCarried, view)));
    }
    return files;
  }
  // Adds a key view that is painted in one other colour in the columns from `begin` to `end`.
  std::string AddPainted(int view, int begin, int end) {
    Image lab = WallPan(kWidth, kHeight, view);
    std::fill_n(lab.Plane(1), lab.PlaneSize(), -25.0f);
    std::fill_n(lab.Plane(2), lab.PlaneSize(), -5.0f);
    const Image srgb = SrgbFromLab(lab);
    Image painted(kWidth, kHeight, 4);
    std::copy(srgb.data.begin(), srgb.data.end(), painted.data.begin());
    for (int y = 0; y < kHeight; ++y) {
      for (int x = begin; x < end; ++x) painted.At(3, y, x) = 1.0f;
    }
    ColorizeKeyViewOptions key;
    key.view = scene_.views[view].name;
    key.file = scratch_.path() / "painted.png";
    WriteFileAtomic(key.file, EncodePng16(painted));
    return AddKeyView(key);
  }
  Scene scene_;
};

TEST_F(AdditionalKeyFrameTest, ChangesNearerFramesAndFillsOthers) {
  CarryColorOptions options;
  const auto before = Run(options);
  options.additional_key_views = {AddPainted(12, 0, kWidth)};
  const auto after = Run(options);
  int filled = 0;
  for (int i = 0; i < kFrames; ++i) {
    if (i > 7) {
      EXPECT_NE(before[i], after[i]) << i;
      continue;
    }
    const AbMap was = DecodeAbPng(before[i], "before"), is = DecodeAbPng(after[i], "after");
    for (size_t p = 0; p < was.confidence.data.size(); ++p) {
      const float a = is.ab.data[p];
      if (a == was.ab.data[p] && is.confidence.data[p] == was.confidence.data[p]) continue;
      ++filled;
      ASSERT_LE(was.confidence.data[p], 0.5f) << i;
      ASSERT_GT(is.confidence.data[p], 0.5f) << i;
      ASSERT_NEAR(a, -25.0f, 1.0f) << "no mean of two: " << i;
    }
  }
  EXPECT_GT(filled, 5 * kHeight) << "the right ends of the frames, which the first does not show";
}

TEST_F(AdditionalKeyFrameTest, KeepsColorOfUnpaintedParts) {
  CarryColorOptions options;
  const AbMap before = DecodeAbPng(Run(options)[13], "before");
  options.additional_key_views = {AddPainted(12, 0, kWidth / 2)};
  const AbMap after = DecodeAbPng(Run(options)[13], "after");
  const Image truth = WallPan(kWidth, kHeight, 13);
  double painted = 0.0, kept = 0.0, sure = 0.0, was_sure = 0.0;
  int count = 0;
  for (int y = 12; y < kHeight - 12; ++y, ++count) {
    painted += std::abs(after.ab.At(0, y, 20) + 25.0f);
    kept += std::abs(after.ab.At(0, y, 70) - truth.At(1, y, 70));
    sure += after.confidence.At(0, y, 70);
    was_sure += before.confidence.At(0, y, 70);
  }
  EXPECT_LT(painted / count, 2.0);
  EXPECT_LT(kept / count, 2.0);
  EXPECT_GT(sure, 0.7 * was_sure);
}

// Two thirds of a column of the reduced picture are painted.
TEST_F(AdditionalKeyFrameTest, BorderOfPaintIsNotPaler) {
  constexpr int kSide = 64, kBorder = 28;
  const ViewImages images(scene_, scratch_.path(), kSide);
  AddPainted(12, 0, 43);
  const StageContext context = MakeContext();
  const CarriedColor color = ReadAdditionalKeyColor(context, scene_, 12, images);
  const int y = color.ab.height / 2;
  EXPECT_NEAR(color.confidence.At(0, y, kBorder - 1), 1.0, 1e-4);
  EXPECT_NEAR(color.confidence.At(0, y, kBorder), 2.0 / 3.0, 0.02);
  EXPECT_EQ(color.confidence.At(0, y, kBorder + 1), 0.0f);
  for (const int x : {kBorder - 1, kBorder, kBorder + 1}) {
    EXPECT_NEAR(color.ab.At(0, y, x), -25.0f, 0.5f) << "also between pixels: " << x;
  }
}

}  // namespace
}  // namespace color3d
