#include "core/stage/coloring/recolored_views.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/color/lab.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {
using ::testing::HasSubstr;

constexpr int kWidth = 128, kHeight = 96;
constexpr double kFocal = 110.0, kDepth = 4.0;

// A textured wall with reddish and bluish stripes; stripes are 1.6 wide.
bool IsRed(double x) { return std::fmod(x + 16.0, 3.2) < 1.6; }
LabColor Wall(double x, double y) {
  const double l = 50.0 + 12.0 * std::sin(4.0 * x + y) + 10.0 * std::sin(9.0 * y - 2.0 * x) +
                   8.0 * std::sin(17.0 * x) * std::cos(13.0 * y);
  return {l, IsRed(x) ? 30.0 : -5.0, (IsRed(x) ? 15.0 : -20.0) + 4.0 * std::sin(y)};
}

// Three cameras along the wall; each sees half of what its neighbour sees.
class RecoloredViewsTest : public StageTest {
 protected:
  RecoloredViewsTest() {
    for (int i = 0; i < 3; ++i) {
      View view;
      view.name = view.image_file = "p" + std::to_string(i) + ".png";
      view.camera = {kWidth, kHeight, kFocal, kFocal, kWidth / 2.0, kHeight / 2.0};
      view.captured_camera = view.camera;
      view.cam_from_world.translation = {-AtX(i), 0.0, 0.0};
      scene_.views.push_back(view);
      WritePhoto(i, false);
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
    AddInput(artifact::kKeyView, R"({"view": "p0.png"})");
    AddInput(artifact::kGeometry, SerializeGaussians(model));
  }

  static double AtX(int view) { return 2.3 * view; }
  static double WallX(int view, int x) {
    return AtX(view) + kDepth * (x + 0.5 - kWidth / 2.0) / kFocal;
  }
  // The Lab picture of a view within the gamut, with the red stripes made green if `edited`.
  static Image Photo(int view, bool edited) {
    Image lab(kWidth, kHeight, 3);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const double at = WallX(view, x);
        const LabColor color = Wall(at, kDepth * (y + 0.5 - kHeight / 2.0) / kFocal);
        lab.At(0, y, x) = static_cast<float>(color.l);
        lab.At(1, y, x) = static_cast<float>(color.a - (edited && IsRed(at) ? 55.0 : 0.0));
        lab.At(2, y, x) = static_cast<float>(color.b);
      }
    }
    return LabFromSrgb(SrgbFromLab(lab));
  }
  void WritePhoto(int view, bool gray) {
    const Image lab = Photo(view, false);
    WriteFileAtomic(
        scratch_.path() / scene_.views[view].image_file,
        EncodePng16(gray ? SrgbFromLab(Image(kWidth, kHeight, 1, 50.0f)) : SrgbFromLab(lab)));
  }
  // Edits the key view and runs the stages up to the colours of the views.
  void Run(bool carry) {
    ColorizeKeyViewOptions key;
    key.source = ColorizeKeyViewOptions::Source::kEdit;
    key.file = scratch_.path() / "edited.png";
    WriteFileAtomic(key.file, EncodePng16(SrgbFromLab(Photo(0, true))));
    RunForInputs([&](StageContext& context) { RunColorizeKeyView(key, context); });
    if (carry) {
      CarryColorOptions options;
      options.depth_side_px = kWidth;
      RunForInputs([&](StageContext& context) { RunCarryColor(options, context); });
    }
    RunForInputs([](StageContext& context) { RunPersonalize({.iterations = 0}, context); });
    RunForInputs([](StageContext& context) { RunColorizeViews({.max_side_px = kWidth}, context); });
  }
  // Mean and largest difference of chroma to the edited photo, of the red stripes or the others.
  // Two pixels at borders of stripes are left out.
  struct Errors {
    double mean = 0.0, max = 0.0;
  };
  Errors ErrorOf(int view, bool red) {
    const std::string name = ViewArtifact(artifact::kViewsAb, scene_.views[view]);
    const Image ab = DecodeAbPng(ReadFile(inputs_.at(name)), name).ab;
    const Image truth = Photo(view, true);
    Errors errors;
    int count = 0;
    for (int x = 3; x < kWidth - 3; ++x) {
      if (IsRed(WallX(view, x)) != red || IsRed(WallX(view, x - 3)) != red ||
          IsRed(WallX(view, x + 3)) != red) {
        continue;
      }
      for (int y = 0; y < kHeight; ++y) {
        const double e =
            std::hypot(ab.At(0, y, x) - truth.At(1, y, x), ab.At(1, y, x) - truth.At(2, y, x));
        errors.mean += e;
        errors.max = std::max(errors.max, e);
        ++count;
      }
    }
    errors.mean /= count;
    return errors;
  }

  Scene scene_;
};

TEST_F(RecoloredViewsTest, KeepsOwnColorsOutsideEdit) {
  Run(/*carry=*/true);
  for (int view = 0; view < 3; ++view) {
    EXPECT_LT(ErrorOf(view, /*red=*/false).max, 0.1) << view;
    EXPECT_LT(ErrorOf(view, /*red=*/true).mean, 3.0) << view;  // 55 without the edit
  }
}

TEST_F(RecoloredViewsTest, InfersEditWithoutCarriedColor) {
  Run(/*carry=*/false);
  for (int view = 1; view < 3; ++view) {
    EXPECT_LT(ErrorOf(view, /*red=*/false).max, 0.1) << view;
    EXPECT_LT(ErrorOf(view, /*red=*/true).mean, 6.0) << view;
  }
}

TEST_F(RecoloredViewsTest, WarnsOfGrayPhotos) {
  WritePhoto(2, /*gray=*/true);
  Run(/*carry=*/true);
  EXPECT_THAT(observer_.text, HasSubstr("1 of 3 photos are grey"));
  EXPECT_LT(ErrorOf(1, /*red=*/false).max, 0.1);
}

}  // namespace
}  // namespace color3d
